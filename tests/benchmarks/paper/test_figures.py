"""What the figures' numbers are made of."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.inference import engine_version
from bolfi_liquids.inference.simulations import Compute

from bolfi_liquids import inference, models
from bolfi_liquids.inputs.cups import bundled_cups

from .figures import FIGURES
from .figures_of_spillage import interval
from .learners import by_stirring_and_pouring
from .shared_simulations import SharedSimulations
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
