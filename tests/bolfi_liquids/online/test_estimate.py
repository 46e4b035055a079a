"""Estimates from data so far: the paper's integral up to then, and nothing else."""

import time

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import star
from bolfi_liquids.inference import Bolfi
from bolfi_liquids.inference.simulations import Simulation, columns
from bolfi_liquids.inference.simulations.failures import raised
from bolfi_liquids.models.accuracy import stirring_error

import bolfi_liquids as bl
from bolfi_liquids import models
from bolfi_liquids.calibration.summary import BAD_FIT_RATIO
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.inputs.recording import planned_recording
from bolfi_liquids.online.estimate import (
    OnlineEstimate,
    Problem,
    answer,
    design,
    estimate,
    fit_to_noise,
    proposals,
)
from bolfi_liquids.online.plan import PartialRecording, align, stroke_ends
from bolfi_liquids.online.record import BAD_FIT, sentence
from bolfi_liquids.online.settings import OnlineSettings
from bolfi_liquids.pouring.spillage import Judged
from bolfi_liquids.simulators import stir_simulator

ATTRS = {
    "cup_radius": 0.04,
    "cup_height": 0.075,
    "fill": 0.05,
    "stick_radius": 0.0045,
    "stick_length": 0.22,
    "stick_density": 1200.0,
    "liquid_density": 1000.0,
}
PATH = star(speed=0.1, height=0.235)
PLAN = planned_recording(PATH.time, PATH.position, ATTRS)
ENDS = stroke_ends(PLAN)
TRUTH = {"viscosity": np.array([0.5]), "cohesion": np.array([0.4])}
NOISE = 0.01


class NoMap:
    """In the place of a map of landings: what it was asked."""

    def best(self, liquids):
        self.liquids = liquids
        spilled = float(liquids["cohesion"].mean())
        return Judged(1.0, 0.02, np.array([[spilled, 1.0 - spilled, 0.0]]))


def signals(theta, seeds, times=PLAN.time):
    """The more viscous, the wider the stick swings, in (B, T, 2); NOISE between seeds."""
    size = 0.05 + 0.02 * np.log10(theta["viscosity"] / 3e-3)
    wave = np.stack([np.sin(times), np.cos(times)], axis=1)
    noise = [np.random.default_rng(seed).normal(0.0, NOISE, wave.shape) for seed in seeds]
    return size[:, None, None] * wave + noise


def problem(**settings):
    return Problem(default_prior(), stir_simulator([PLAN], 200), OnlineSettings(**settings))


def made(of, times=PLAN.time):
    jobs = design(of)
    made_of = signals(*columns(jobs), times)
    return tuple((job, Simulation(one, None, 0.1)) for job, one in zip(jobs, made_of, strict=True))


def data(strokes, seed=1234):
    until = PLAN.time <= ENDS[strokes - 1]
    seen = signals(TRUTH, [seed])[0]
    return PartialRecording(PLAN.time[until], PATH.position[until], seen[until], 0.0)


def aligned(strokes, seed=1234):
    return align(PLAN, ENDS, data(strokes, seed))


def test_missing_samples_equal_a_shorter_recording():
    """What is NaN after a stroke teaches what a recording up to there would have taught."""
    of = problem()
    known, seen = made(of), aligned(4)
    samples = int(np.isfinite(seen.observed).all(axis=1).sum())
    short = planned_recording(PLAN.time[:samples], PATH.position[:samples], ATTRS)
    stirring = stir_simulator([short], 200)
    engine = Bolfi(
        of.prior,
        seen.observed[:samples],
        discrepancy=stirring.discrepancy(),
        threshold="min_mean",
    )
    theta, seeds = columns([job for job, _ in known])
    engine.tell(theta, np.stack([one.signal[:samples] for _, one in known]), seeds)
    fit = engine.fit()
    again = fit.sample("quadrature", chains=2, draws=500, seed=0)["posterior"]
    asked = NoMap()
    estimate(of, known, seen, asked, 0.0)
    np.testing.assert_array_equal(again["viscosity"].to_numpy().ravel(), asked.liquids["viscosity"])
    # the paper's integral, by another rule than the engine's own
    square = np.square(seen.observed[:samples] - known[0][1].signal[:samples]).sum(axis=1)
    assert fit.history.discrepancy[0] == pytest.approx(np.trapezoid(square, short.time))


def test_design_is_the_same_again_and_all_over_the_prior():
    of = problem(design=32)
    jobs = design(of)
    assert jobs == design(of)
    theta = {name: np.array([job.theta[name] for job in jobs]) for name in of.prior.names}
    u = of.prior.to_unit(theta)
    # one point in each of eight stripes, along both axes
    assert all(np.unique(np.floor(8 * axis)).size == 8 for axis in u.T)
    assert len({job.seed for job in jobs}) == 32


def test_proposals_are_new_points_with_new_seeds_and_failed_ones_are_not_learned_from():
    of = problem()
    known, seen = made(of), aligned(6)
    first = proposals(of, known, seen.observed, 2)
    assert first == proposals(of, known, seen.observed, 2)
    failed = Simulation(None, raised(OSError("it raised")), 0.1)
    good = Simulation(signals(TRUTH, [7])[0], None, 0.1)
    later = (*known, (first[0], failed), (first[1], good))
    jobs = first + proposals(of, later, seen.observed, 2)
    assert len({job.seed for job in [*jobs, *(job for job, _ in known)]}) == 4 + 16
    assert len({job.theta["viscosity"] for job in jobs}) == 4
    assert estimate(of, later, seen, NoMap(), 0.0).simulations == 17


def test_data_are_answered_once_a_stroke_or_refused():
    of = problem()
    known = made(of)
    first = answer(of, known, NoMap(), 0, data(2))
    assert (first.aligned.strokes, first.estimate.strokes, first.refusal) == (2, 2, "")
    assert answer(of, known, NoMap(), 2, data(2)) == (None, None, "")
    away = data(3)._replace(position=data(3).position + 0.01)
    refused = answer(of, known, NoMap(), 2, away)
    assert refused.aligned is refused.estimate is None and "off its plan" in refused.refusal
    # the data are kept, for simulations that may succeed
    few = answer(of, known[:2], NoMap(), 0, data(2))
    assert few.aligned.strokes == 2 and few.estimate is None and few.refusal


def test_an_estimate_is_as_late_as_its_stroke_ended_before_it():
    """Data that go on after the stroke tell when it ended."""
    of = problem()
    now = time.monotonic()
    later = data(3)._replace(ended=now)
    seen = later.time <= ENDS[1] + 0.5
    cut = PartialRecording(*(column[seen] for column in later[:3]), ended=now)
    found = answer(of, made(of), NoMap(), 0, cut)
    assert found.estimate.lag == pytest.approx(time.monotonic() - now + 0.5, abs=0.5)


def test_it_is_enough_when_one_pour_in_twenty_spills_more_than_the_target():
    for target, strokes, ends in ((0.02, 9, False), (0.04, 8, False), (0.04, 9, True)):
        found = OnlineEstimate(strokes, 1.0, {}, {}, 0.01, 0.03, 16, 0.1, 0.0, 0.0, ())
        assert found.is_enough(OnlineSettings(target=target)) is ends


def test_an_estimate_that_fits_nothing_says_so_and_ends_nothing():
    of = problem()
    known, good = made(of), aligned(len(ENDS))
    found = estimate(of, known, good, NoMap(), 0.0)
    assert found.fits and 0.5 < found.fit_to_noise < BAD_FIT_RATIO
    settings = OnlineSettings(target=0.99)
    assert found.is_enough(settings)
    wrong = good._replace(observed=good.observed + 0.2)  # the zero of a camera is elsewhere
    lost = estimate(of, known, wrong, NoMap(), 0.0)
    assert lost.fit_to_noise > BAD_FIT_RATIO and not lost.fits
    assert not lost.is_enough(settings)
    assert BAD_FIT in sentence(lost) and BAD_FIT not in sentence(found)


def test_the_noise_of_a_fit_is_that_of_cameras_and_between_simulations(rng):
    truth = np.stack([np.sin(PLAN.time), np.cos(PLAN.time)], axis=1)
    spread = rng.normal(0.0, 0.02, (5, *truth.shape))
    observed = truth + rng.normal(0.0, 0.02, truth.shape)
    observed[len(truth) // 2 :] = np.nan
    # sqrt(2) of one noise between two signals; sqrt(1 + 2) with the cameras' own
    ones = np.ones(5)
    found = fit_to_noise(observed, truth + spread, ones)
    assert found == pytest.approx(np.sqrt(2.0 / 3.0), rel=0.1)
    # without noise, a camera's is taken
    error = np.degrees(stirring_error(1.0))
    still = np.repeat(truth[None], 3, axis=0)
    found = fit_to_noise(truth + np.radians(0.5), still, ones[:3])
    assert found == pytest.approx(np.sqrt(0.5**2 - error**2) / 0.1, rel=1e-6)
    # as much as the simulator errs by in a thin liquid is none of the fit's
    assert fit_to_noise(truth + np.radians(0.5), still, 1e-3 * ones[:3]) < 1e-6


@pytest.mark.slow
def test_an_online_estimate_names_a_wrong_frame():
    """A stick that leans ahead of the gripper: the sign of a plane is wrong."""
    recording = bundled_recording("glycerin")
    plan = planned_recording(recording.time, recording.gripper.position, recording.attrs)
    of = Problem(default_prior(), stir_simulator([plan], 200), OnlineSettings(design=8))
    ends = stroke_ends(plan)
    for sign, faults in ((1.0, 0), (-1.0, 1)):
        seen = recording.inclination * [1.0, sign]
        whole = PartialRecording(recording.time, recording.gripper.position, seen, 0.0)
        known = made(of, recording.time)
        found = estimate(of, known, align(plan, ends, whole), NoMap(), 0.0)
        assert len(found.frame_faults) == faults
        assert not (faults and found.fits)


def test_a_budget_holds_the_design():
    with pytest.raises(InputError) as refused:
        OnlineSettings(design=16, budget=12)
    assert "budget" in refused.value.where


def test_a_simulation_of_the_plan_begins_like_one_of_its_beginning(short_recording):
    """Causality: what comes later changes no bit of what came before."""
    recording = bl.open_recording(short_recording)
    setup = models.StirSetup.from_recording(recording, particles=200)
    liquid = models.Liquid([0.02, 1.0], [0.2, 0.7], recording.number("liquid_density"))
    whole = models.stir(liquid, recording.gripper, setup, [3, 4])
    begins = type(recording.gripper)(*(part[:45] for part in recording.gripper))
    part = models.stir(liquid, begins, setup, [3, 4])
    # the curve through the last samples bends by those that follow
    np.testing.assert_array_equal(part[:, :-3], whole[:, :42])
