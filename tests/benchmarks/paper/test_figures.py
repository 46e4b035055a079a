"""What the figures' numbers are made of."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.inference import engine_version
from bolfi_liquids.inference.simulations import Compute

from bolfi_liquids import inference, models
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.pour_table import open_pours

from . import shared_simulations, sticky
from .figure_of_adhesion import adhesion
from .figures import FIGURES
from .figures_of_spillage import interval
from .learners import by_stirring_and_pouring
from .shared_simulations import SharedSimulations
from .sticky_study import Stuck
from .study import conclusions
from .study_size import FULL
from .truths import draw_truths


def test_the_readme_tells_each_figure_and_its_file():
    told = (Path(__file__).parent / "README.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in told and f"`{name}.nc`" in told for name in FIGURES)


def test_the_interval_covers_the_mean_as_often_as_it_says():
    rng = np.random.default_rng(0)
    samples = rng.exponential(size=(200, 40))
    ends = np.array([interval(values, seed=at) for at, values in enumerate(samples)])
    held = (ends[:, 0] <= 1.0) & (ends[:, 1] >= 1.0)
    # 90 %, less what the bootstrap of a skewed sample of 40 is known to lose; four standard errors
    least = 0.87 - 4.0 * np.sqrt(0.87 * 0.13 / 200)
    assert held.mean() > least
    middle = ends.mean(axis=1)
    narrow = np.abs(1.0 - middle) <= 0.6 * (ends[:, 1] - middle)  # too narrow ones are found
    assert narrow.mean() < least


def test_an_interval_of_nothing_is_nan():
    assert np.isnan(interval(np.empty(0))).all()


@pytest.mark.parametrize(
    ("part", "name"), [(engine_version, "ENGINE_VERSION"), (models, "MODEL_VERSION")]
)
def test_what_another_version_made_is_left_alone(tmp_path, monkeypatch, part, name):
    """Kept calibrations go by name; those of another engine or model are others."""
    shared = SharedSimulations(tmp_path, FULL, None)
    learner = by_stirring_and_pouring(bundled_cups(), FULL, ":memory:")["pour"]
    now = shared.runs, learner.identity
    monkeypatch.setattr(part, name, "another", raising=False)
    assert shared.runs != now[0]
    assert part is models or learner.identity != now[1]


class Failing:
    """Concludes what the liquid's viscosity is, but for one seed."""

    identity = "stub"

    def __init__(self, seed):
        self.seed = seed

    def simulate(self, theta, seeds):
        if self.seed in seeds:
            raise RuntimeError("no fit")
        return theta["viscosity"][:, None]


@pytest.mark.parametrize("pooled", [False, True])
def test_conclusions_are_those_of_the_truths_and_a_failed_one_is_none(pooled):
    truths = draw_truths(1, seed=0)
    with inference.SimulationBank() as bank, ThreadPoolExecutor(2) as pool:
        compute = Compute(bank=bank, executor=pool if pooled else None)
        found = conclusions(Failing(truths.seed[2]), "stub", truths, compute)
    assert found[2] is None
    for at in (0, 1, 3, 4):
        assert found[at] == truths.viscosity[at]


@pytest.mark.slow
def test_a_sticky_truth_is_made_once(tmp_path):
    truth = sticky.draw_sticky(3, seed=0)
    assert truth == sticky.draw_sticky(3, seed=0) != sticky.draw_sticky(4, seed=0)
    recording = sticky.stirred(truth, 200, tmp_path / "stir.nc")
    like = bundled_recording(sticky.STICKY_LIQUID)
    np.testing.assert_array_equal(recording.gripper.position, like.gripper.position)
    # of the same path, so it leans alike, but no copy
    off = np.degrees(recording.inclination - like.inclination)
    assert 0.05 < np.sqrt(np.nanmean(off**2)) < 5.0
    assert sticky.stirred(truth, 200, tmp_path / "stir.nc").hash == recording.hash


@pytest.mark.minutes
def test_a_sticky_truth_lands_nearer_to_its_cup_than_one_that_flows(tmp_path):
    """As the volume-of-fluid reference does of both its liquids, from 110 deg to 60."""
    truth = sticky.draw_sticky(0, seed=0)
    clean = truth._replace(theta={**truth.theta, "adhesion": 0.0})
    stuck, flown = (
        open_pours(sticky.poured(one, 900.0, sticky.waxed_cups(), tmp_path / f"{at}.csv"))
        for at, one in enumerate((truth, clean))
    )
    np.testing.assert_allclose(stuck.fractions.sum(axis=1), 1.0, atol=1e-6)
    spilled, otherwise = stuck.fractions[:, 0], flown.fractions[:, 0]
    beyond = (flown.distance < 0.02) & (otherwise > 0.1)  # it flies over a receiver that is near
    assert beyond.any() and (spilled < otherwise - 0.02)[beyond].all()


class Pickling(ThreadPoolExecutor):
    """What is submitted would reach another process."""

    def submit(self, fn, /, *args, **kwargs):
        return super().submit(*pickle.loads(pickle.dumps((fn, *args))), **kwargs)


def stuck(out, runs, scale, number):
    """In place of half an hour's simulations."""
    spilled = [0.01 * number, 0.2, 0.1, 0.05]
    return Stuck(sticky.draw_sticky(number, scale.seed), spilled, "adhesion" if number else "")


def test_what_sticks_is_told_by_liquid_with_a_pool_and_without(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_simulations, "spilled_where_it_sticks", stuck)
    with Pickling(2) as pool:
        for executor in (pool, None):
            shared = SharedSimulations(tmp_path, FULL, None, executor)
            shared.begin_sticky()
            adhesion(shared)
            drawn = adhesion(shared)  # as often as it is wanted
            believed = drawn.data.spilled.sel(case="believed").values
            np.testing.assert_array_equal(believed, 0.01 * np.arange(FULL.sticky))
            truths = [sticky.draw_sticky(at, FULL.seed) for at in range(FULL.sticky)]
            stickiness = [truth.theta["adhesion"] for truth in truths]
            np.testing.assert_array_equal(drawn.data.adhesion.values, stickiness)
            assert (
                "10.0 points won back (paired, 90 %: 10.0 to 10.0) of 15.0; adhesion" in drawn.says
            )
            assert "named alone in 4 of 5" in drawn.says
