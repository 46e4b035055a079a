"""Online calibration in its own processes, fed with recordings as if they were being made."""

import json
import os
import signal
import sqlite3
import time
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import ExitStack, nullcontext
from dataclasses import asdict, replace
from functools import partial
from multiprocessing import active_children
from types import SimpleNamespace

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids import models
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.online import online
from bolfi_liquids.online.estimate import Answer, Problem
from bolfi_liquids.online.online import OnlineCalibration, OnlineChoice, OnlinePhase
from bolfi_liquids.online.plan import PartialRecording
from bolfi_liquids.online.settings import OnlineSettings
from bolfi_liquids.run.run import alone_in
from bolfi_liquids.simulators import stir_simulator

# the process that simulates gives way to others: beside another test it gets little
PATIENCE_S = 600
SMALL = OnlineSettings(particles=200, pours=64, design=8, budget=24, target=1e-9)


def made_up(liquid, angular_velocity, cups, seeds, particles, effects=None):
    """In place of pours: streams a little wider than the receiver, so that each spills."""
    lands = 0.03 + 0.005 * np.log10(liquid.viscosity)
    position = np.zeros((len(seeds), 50, 2), np.float32)
    position[..., 0] = lands[:, None] + np.linspace(-0.037, 0.037, 50)
    return models.Landings(position, np.zeros(len(seeds)))


def start(recording, out, settings):
    """With a map of pours that are made up."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(models, "landings", made_up)
        return OnlineCalibration.start(
            recording.gripper,
            recording.attrs,
            OnlineChoice(out, settings=settings),
            progress=False,
        )


def until(wanted, of):
    """Poll until `wanted` says so."""
    ends = time.monotonic() + PATIENCE_S
    while not wanted() and of.phase != OnlinePhase.FAILED and time.monotonic() < ends:
        time.sleep(0.01)
        of.poll()
    return wanted()


def so_far(recording, end, off=0.0):
    seen = recording.time <= end
    path = recording.gripper.position[seen] + off
    now = time.monotonic()
    return PartialRecording(recording.time[seen], path, recording.inclination[seen], now)


def replay(recording, of, *, realtime=False):
    """Estimates of a finished recording that is handed over stroke by stroke, until one is enough.

    In real time strokes come as fast as they were made; else each waits for the estimate of the
    one before.
    """
    began = time.monotonic()
    for end in of.ends:
        arrives = began + end - recording.time[0]
        while realtime and time.monotonic() < arrives:
            time.sleep(0.02)
            of.poll()
        before = len(of.estimates)
        of.update(so_far(recording, end))
        assert realtime or until(lambda before=before: len(of.estimates) > before, of), of.detail
        if any(one.is_enough(of.settings) for one in of.estimates[-1:]):
            break
    return of.estimates


def now(of):
    """How it is doing."""
    return SimpleNamespace(phase=of.phase, detail=of.detail, simulations=len(of.made))


def process(executor):
    """Its number and niceness, and whether it has loaded JAX."""
    pid = executor.submit(os.getpid).result()
    loaded = executor.submit(eval, "'jax' in __import__('sys').modules").result()
    return SimpleNamespace(pid=pid, niceness=os.getpriority(os.PRIO_PROCESS, pid), jax=loaded)


@pytest.fixture(scope="module")
def story(short_recording, tmp_path_factory):
    """One stir: as it should be, off the plan, without the simulator, without the learner."""
    recording = bl.open_recording(short_recording)
    out = tmp_path_factory.mktemp("online") / "run"
    started = start(recording, out, SMALL)
    told = SimpleNamespace(out=out, recording=recording)
    with started as of:
        told.early = now(of)
        told.ready = of.wait_until_ready(PATIENCE_S)
        told.prepared = now(of)
        of.update(so_far(recording, of.ends[0]))
        until(lambda: of._unread is None, of)
        of.update(so_far(recording, of.ends[1], off=0.01))  # waits, and is replaced
        of.update(so_far(recording, of.ends[1]))
        told.phases = {of.phase}
        assert until(lambda: told.phases.add(of.phase) or len(of.estimates) == 2, of)
        told.estimates = list(of.estimates)
        until(lambda: len(of.made) > SMALL.design, of)
        told.later = now(of)
        told.learner, told.simulator = process(of._learner), process(of._simulator)
        of.update(so_far(recording, of.ends[2], off=0.01))
        until(lambda: of.phase == OnlinePhase.REFUSED, of)
        told.refused = now(of)
        os.kill(told.simulator.pid, signal.SIGKILL)
        of.update(so_far(recording, of.ends[2]))
        until(lambda: len(of.estimates) > 2 and "died" in of.detail, of)
        told.alone, told.last = now(of), of.estimates[-1]
        os.kill(told.learner.pid, signal.SIGKILL)
        told.after = of.update(so_far(recording, of.ends[2]))
        until(lambda: of.phase == OnlinePhase.FAILED, of)
        told.dead = now(of)
    return told


@pytest.mark.slow
def test_it_prepares_and_then_answers_every_stroke(story):
    assert story.early.phase is OnlinePhase.PREPARING
    assert story.ready and story.prepared.simulations == SMALL.design
    assert [one.strokes for one in story.estimates] == [1, 2]
    assert story.phases == {OnlinePhase.READY}  # data that wait are replaced by newer ones
    for one in story.estimates:
        assert set(one.parameters) == {"viscosity", "cohesion"}
        for spread in one.parameters.values():
            assert spread.q05 < spread.q50 < spread.q95
        assert 0.0 <= one.expected_spillage <= one.spillage_q95 <= 1.0
        assert 0.0 < one.lag < PATIENCE_S
        assert one.simulations >= SMALL.design


@pytest.mark.slow
def test_control_and_cameras_come_first_and_only_the_learner_loads_jax(story):
    here = os.getpriority(os.PRIO_PROCESS, 0)
    assert story.learner.niceness == min(here + 5, 19)
    assert story.simulator.niceness == min(here + 10, 19)
    assert story.learner.jax and not story.simulator.jax


@pytest.mark.slow
def test_simulations_go_on_while_the_robot_stirs_and_none_is_made_twice(story):
    assert story.later.simulations > SMALL.design
    connection = sqlite3.connect(story.out / online.BANK)
    rows = connection.execute("SELECT theta, seed FROM simulation").fetchall()
    connection.close()
    assert len(set(rows)) == len(rows)
    stirs = [row for row in rows if "angular_velocity" not in row[0]]
    assert story.later.simulations <= len(stirs) <= SMALL.budget


@pytest.mark.slow
def test_estimates_are_logged(story):
    lines = (story.out / online.LOG).read_text().splitlines()
    logged = [json.loads(line) for line in lines]
    assert [one["strokes"] for one in logged] == [1, 2, 3]
    spread = story.estimates[1].parameters["viscosity"]
    assert logged[1]["parameters"]["viscosity"] == asdict(spread)


@pytest.mark.slow
def test_what_goes_wrong_is_told_and_disturbs_nobody(story):
    assert "mm off its plan" in story.refused.detail
    # without its simulator it goes on
    assert story.last.strokes == 3 and story.alone.phase is OnlinePhase.READY
    assert "simulates has died" in story.alone.detail
    assert "learns has died" in story.dead.detail and story.after is None
    running = {child.pid for child in active_children()}
    assert not running & {story.learner.pid, story.simulator.pid}


class Inline(Executor):
    """Does what is submitted at once, until it is dead."""

    dead = False

    def submit(self, task, /, *given):
        if self.dead:
            raise BrokenExecutor
        done = Future()
        done.set_result(task(*given))
        return done


def test_what_becomes_of_data_simulations_and_dead_processes(
    short_recording, tmp_path, monkeypatch
):
    """The order of its tasks, without processes."""
    plan = bl.open_recording(short_recording)
    few, made = replace(SMALL, budget=9), tuple(range(8))
    problem = Problem(default_prior(), stir_simulator([plan], SMALL.particles), few)
    learner, simulator = Inline(), Inline()
    executors, asked = iter([learner, simulator]), []
    estimate = SimpleNamespace(as_record=lambda: {"strokes": 1})
    aligned = SimpleNamespace(strokes=1, observed="seen")
    answers = iter([Answer(refusal="off its plan"), Answer(aligned, estimate), Answer()])
    monkeypatch.setattr(online, "background_process", lambda _: nullcontext(next(executors)))
    monkeypatch.setattr(online, "design", lambda _: made)
    monkeypatch.setattr(online, "answer", lambda *given: asked.append(given[2:]) or next(answers))
    monkeypatch.setattr(online, "proposals", lambda _, made, observed, n: ("proposed",))
    with OnlineCalibration(problem, tmp_path, lambda: "map", lambda jobs: jobs, ExitStack()) as of:
        assert of.phase is OnlinePhase.PREPARING
        assert of.wait_until_ready(10.0) and of.made == made
        assert of.update("first") is None  # ordered
        assert of.poll() is None
        assert (of.phase, of.detail) == (OnlinePhase.REFUSED, "off its plan")
        of.update("second")
        assert of.update("third") is estimate and of.phase is OnlinePhase.READY
        assert asked == [("map", 0, "first"), ("map", 0, "second"), ("map", 1, "third")]
        assert json.loads((tmp_path / online.LOG).read_text()) == {"strokes": 1}
        for _ in range(5):
            of.poll()
        assert of.made == (*made, "proposed")  # and no more than the budget
        of.settings, simulator.dead = SMALL, True
        for _ in range(3):
            of.poll()
        assert of.phase is OnlinePhase.READY and "simulates has died" in of.detail
        learner.dead = True
        assert of.update("fourth") is None
        assert of.phase is OnlinePhase.FAILED and "learns has died" in of.detail


def test_a_run_is_free_again_where_nothing_could_begin(short_recording, tmp_path, monkeypatch):
    def refused(niceness):
        raise OSError("no process")

    recording = bl.open_recording(short_recording)
    monkeypatch.setattr(online, "background_process", refused)
    with pytest.raises(OSError, match="no process"):
        start(recording, tmp_path, SMALL)
    with alone_in(tmp_path):
        pass


@pytest.mark.slow
def test_a_plan_that_cannot_be_simulated_is_told_before_the_map_is_learned(
    short_recording, tmp_path
):
    plan = bl.open_recording(short_recording)
    problem = Problem(default_prior(), stir_simulator([plan], SMALL.particles), SMALL)
    long, refuse = partial(time.sleep, 2 * PATIENCE_S), int  # of a list of jobs: a TypeError
    with OnlineCalibration(problem, tmp_path, long, refuse, ExitStack()) as of:
        assert not of.wait_until_ready(PATIENCE_S)
        assert of.phase is OnlinePhase.FAILED
        assert "cannot be simulated" in of.detail


@pytest.mark.slow
def test_a_run_is_not_overwritten(short_recording, tmp_path):
    recording = bl.open_recording(short_recording)
    (tmp_path / "run.toml").touch()
    with pytest.raises(ValueError, match="holds a run already"):
        OnlineCalibration.start(recording.gripper, recording.attrs, OnlineChoice(tmp_path))


@pytest.mark.slow
def test_stops_at_the_target_and_calibrates(short_recording, tmp_path):
    recording = bl.open_recording(short_recording)
    settings = replace(SMALL, budget=8, target=0.9, least_strokes=1)
    with start(recording, tmp_path / "run", settings) as of:
        assert of.wait_until_ready(PATIENCE_S), of.detail
        estimates = replay(recording, of)
        run = of.finish(recording, budget=8, progress=False)
    assert [one.strokes for one in estimates] in ([1], [1, 2])  # of 3
    calibration = bl.Calibration.open(run)
    assert calibration.summary.n_simulations == 8
    last = estimates[-1].parameters["viscosity"]
    ordinary = calibration.summary.parameters["viscosity"]
    assert last.q05 < ordinary.q95 and ordinary.q05 < last.q95


@pytest.mark.minutes  # at full size and in real time; the test above has it of a small one
def test_the_last_estimate_agrees_with_the_ordinary_calibration(tmp_path):
    recording = bundled_recording("glycerin")
    with start(recording, tmp_path / "run", OnlineSettings(target=1e-9)) as of:
        assert of.wait_until_ready(PATIENCE_S), of.detail
        estimates = replay(recording, of, realtime=True)
        assert until(lambda: estimates[-1:] and estimates[-1].strokes == len(of.ends), of), (
            of.detail
        )
        assert until(lambda: len(of.made) > of.settings.design, of), of.detail
        ordinary = bl.Calibration.open(of.finish(recording, budget=40, progress=False))
    last = estimates[-1].parameters["viscosity"]
    other = ordinary.summary.parameters["viscosity"]
    assert last.q05 < other.q95 and other.q05 < last.q95
