"""Nothing goes wrong anywhere in the prior box; what is made to go wrong is NaN, with a reason."""

import subprocess
import sys
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from bolfi_liquids.models import faults, runtime
from bolfi_liquids.models.pouring import PourBatch, watched_landings
from bolfi_liquids.models.pours.vessel import RIM
from bolfi_liquids.models.runtime import Watch
from bolfi_liquids.models.stirring import stir
from jax import random

from bolfi_liquids import models

POINTS, BATCH = 500, 25
SOME_EFFECTS = 125  # of the points have a subset of the effects, one for each batch
FEW = 300  # particles of a pour
FIRST, LAST = 0.5, 4.5  # s of the recording: from rest into strokes at 10 cm/s,
HASTE = 2.0  # times as fast
LOOK = 20  # steps between two looks at the particles' speeds
FASTEST = {"stir": 2.0, "pour": 4.0}  # m/s; a fall over the cup's depth gains 1.2, a pour's 1.9
STEEPEST = np.radians(60.0)

STARTS = range(0, POINTS, BATCH)


class Points(NamedTuple):
    """Points of the prior box, every array of shape [n]."""

    liquid: models.Liquid
    effects: dict[str, np.ndarray]
    action: models.PourAction
    seeds: np.ndarray

    def text(self, k):
        """What repeats point k."""
        given = {name: float(values[k]) for name, values in self.effects.items()}
        rate, distance = self.action.angular_velocity[k], self.action.distance[k]
        return f"{self.liquid[k]}, {given}, {rate} rad/s, {distance} m, seed {self.seeds[k]}"


def points(start, cups):
    """The batch of points from number `start` on."""
    rng = np.random.default_rng(start)
    names = sorted(models.EFFECTS)
    if start >= POINTS - SOME_EFFECTS:
        names = [name for name in names if rng.random() < 0.5]
    keys = random.split(random.key(start), len(names))
    return Points(
        models.Liquid(
            viscosity=np.exp(rng.uniform(np.log(1e-3), np.log(50.0), BATCH)),
            cohesion=rng.uniform(0.0, 1.0, BATCH),
            density=rng.uniform(700.0, 1400.0, BATCH),
            adhesion=np.zeros(BATCH),  # drawn as the effect of that name
        ),
        {
            name: np.asarray(models.EFFECTS[name].prior.sample(key, (BATCH,)), float)
            for name, key in zip(names, keys, strict=True)
        },
        models.PourAction(
            rng.uniform(*cups.angular_velocity_range, BATCH),
            rng.uniform(*cups.distance_range, BATCH),
        ),
        start + np.arange(BATCH),
    )


@pytest.fixture(scope="module")
def violent(glycerin):
    """A setup, and the gripper's path from rest into fast strokes."""
    gripper = glycerin.gripper
    part = (gripper.time >= FIRST) & (gripper.time <= LAST)
    path = SimpleNamespace(time=gripper.time[part] / HASTE, position=gripper.position[part])
    return models.StirSetup.from_recording(glycerin), path


def told(run):
    """The result of `run` and the reasons that it warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", models.FailedSimulation)
        result = run()
    return result, [str(warning.message) for warning in caught]


def stir_faults(drawn, violent):
    """Point -> what was wrong with its stir; 0 for what no single one can be told of."""
    setup, path = violent
    fastest, farthest, heights = 0.0, 0.0, (np.inf, -np.inf)

    def look(scene, step):
        nonlocal fastest, farthest, heights
        held = scene.count.to_numpy()[..., None] > np.arange(scene.particles)
        x, y, z = scene.position.to_numpy()[held].T
        fastest = np.linalg.norm(scene.speed.to_numpy()[held], axis=-1).max(initial=fastest)
        farthest = np.hypot(x, y).max(initial=farthest)
        heights = z.min(initial=heights[0]), z.max(initial=heights[1])

    watch = Watch(1.0 / (LOOK * setup.step(path)), look)
    signal, reasons = told(
        lambda: stir(drawn.liquid, path, setup, drawn.seeds, drawn.effects, watch)
    )
    for k, angles in enumerate(signal):
        if not np.isfinite(angles).all():
            yield k, f"not finite: {reasons}"
        elif np.abs(angles).max() > STEEPEST:
            yield k, f"tilt {np.degrees(np.abs(angles).max()):.0f} deg"
    lowest, highest = heights
    checks = {
        f"{farthest:.4f} m from the axis": farthest <= setup.cup.radius,
        f"height {lowest:.4f} to {highest:.4f} m": 0.0 <= lowest and highest <= setup.cup.height,
        f"{fastest:.2f} m/s": fastest < FASTEST["stir"],
    }
    yield from ((0, what) for what, fine in checks.items() if not fine)


def pour_faults(drawn, cups):
    """Point -> what was wrong with its pour; 0 for what no single one can be told of."""
    fastest, astray = 0.0, 0
    source = cups.source

    def look(scene, step):
        nonlocal fastest, astray
        held = scene.count.to_numpy()[..., None] > np.arange(scene.particles)
        fastest = np.linalg.norm(scene.speed.to_numpy()[held], axis=-1).max(initial=fastest)
        x, y, z = scene.position.to_numpy()[held].T
        out = np.hypot(x + source.radius, y)
        inside = (z < 0.0) & (out < source.radius + RIM / 2)
        astray += int((inside & ((out > source.radius) | (z < -source.height))).sum())

    batch = PourBatch(
        drawn.liquid, drawn.action.angular_velocity, cups, drawn.seeds, FEW, drawn.effects
    )
    landed, reasons = told(lambda: watched_landings(batch, Watch(20.0, look)))
    result = landed.into(drawn.action.distance, cups.receiver.radius)
    for k, shares in enumerate(
        np.stack([result.spilled, result.received, result.retained], axis=-1)
    ):
        if not np.isfinite(shares).all():
            yield k, f"not finite: {reasons}"
        elif (shares < 0.0).any() or abs(shares.sum() - 1.0) > 1e-12:
            yield k, f"fractions {shares}"
    checks = {
        f"{astray} particles past the cup's walls": astray == 0,
        f"{fastest:.2f} m/s": fastest < FASTEST["pour"],
    }
    yield from ((0, what) for what, fine in checks.items() if not fine)


@pytest.mark.minutes
@pytest.mark.parametrize("start", STARTS)
def test_no_point_of_the_prior_box_goes_wrong(start, violent, cups):
    drawn = points(start, cups)
    found = [("stir", *fault) for fault in stir_faults(drawn, violent)]
    found += [("pour", *fault) for fault in pour_faults(drawn, cups)]
    told_apart = [f"{scene}: {what}: {drawn.text(k)}" for scene, k, what in found]
    assert not found, "\n".join(told_apart)


ABSURD = {
    # viscosity [Pa s], cohesion, effects, how it ends
    "solid": (3e38, 0.0, {}, faults.UNSOLVED),
    "glue": (0.1, 1e5, {}, faults.RUNAWAY),
    "rock": (0.1, 0.0, {"yield_stress": 1e38}, faults.UNSOLVED),
}
CASES = [pytest.param(n, marks=pytest.mark.minutes if ABSURD[n][2] else []) for n in ABSURD]


@pytest.mark.parametrize("name", CASES)
def test_what_goes_wrong_is_nan_with_a_reason(name, cups):
    """And the other in its batch keeps its bits."""
    viscosity, cohesion, effects, fault = ABSURD[name]
    seeds, action = np.array([1, 2]), models.PourAction(6.0, 0.03)

    def simulate(part):
        liquid = models.Liquid(
            np.array([0.1, viscosity])[part], np.array([0.0, cohesion])[part], 1000.0
        )
        given = {n: np.array([models.EFFECTS[n].neutral, c])[part] for n, c in effects.items()}
        poured = models.pour(liquid, action, cups, seeds[part], FEW, given)
        return np.stack([poured.spilled, poured.received, poured.retained], axis=-1)

    fractions, reasons = told(lambda: simulate(slice(0, 2)))
    assert len(reasons) == 1 and f"seed 2: {faults.REASONS[fault]}" in reasons[0]
    assert np.isnan(fractions[1]).all()
    np.testing.assert_array_equal(fractions[:1], simulate(slice(0, 1)))


def test_a_stir_that_goes_wrong_is_nan_with_a_reason(violent):
    """And the other in its batch keeps its bits."""
    setup, path = violent

    def simulate(viscosity):
        liquid = models.Liquid(np.array(viscosity), 0.2, 1000.0)
        return models.stir(liquid, path, setup, [1, 2][: len(viscosity)])

    angles, reasons = told(lambda: simulate([0.1, 3e38]))
    assert len(reasons) == 1 and f"seed 2: {faults.REASONS[faults.UNSOLVED]}" in reasons[0]
    assert np.isnan(angles[1, 1:]).all()
    np.testing.assert_array_equal(angles[:1], simulate([0.1]))


def test_a_liquid_whose_level_moves_is_a_fault(violent):
    """Steps of 40 ms are too long for it."""
    setup, path = violent
    rough = models.Numerics(longest_step=0.03, courant=1e3)
    setup = replace(setup, numerics=rough, particles=100)
    angles, reasons = told(lambda: models.stir(models.Liquid(0.1, 0.2, 1e3), path, setup, [0]))
    assert reasons and faults.REASONS[faults.DRIFTED] in reasons[0] and np.isnan(angles).any()


@pytest.mark.minutes
def test_a_thread_that_did_not_start_taichi_is_refused_and_does_no_harm(cups):
    def poured():
        liquid = models.Liquid(1.0, 0.2, 1260.0)
        return models.landings(liquid, [2.0], cups, [0], FEW).retained

    before = poured()
    with ThreadPoolExecutor(1) as pool:
        with pytest.raises(runtime.WrongThread, match="--nthreads 1"):
            pool.submit(poured).result()
    np.testing.assert_array_equal(poured(), before)


def test_a_thread_with_the_ident_of_the_ended_owner_is_refused(monkeypatch):
    """Operating systems use idents again, often at once; here the owner's is made to be."""
    lock = runtime.OneThread()
    owner = threading.Thread(target=lock.own, name="ended")
    owner.start()
    owner.join()
    again = SimpleNamespace(get_ident=lambda: owner.ident, current_thread=threading.current_thread)
    monkeypatch.setattr(runtime, "threading", again)
    for _ in range(2):  # a refusal leaves the lock free
        with pytest.raises(runtime.WrongThread, match=owner.name), lock:
            pass


def test_taichi_starts_without_a_word_also_under_a_progress_bar():
    """A progress bar wraps stdout, which Taichi takes for a notebook's."""
    code = """
import io, sys
sys.stdout = io.StringIO()
from bolfi_liquids.models import runtime
runtime.start()
assert not sys.stdout.getvalue()
"""
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (made.returncode, made.stdout, made.stderr) == (0, "", "")
