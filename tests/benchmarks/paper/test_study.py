"""One search that is looked at after several numbers of simulations."""

import numpy as np
import numpyro.distributions as dist
import pytest

from bolfi_liquids import inference
from bolfi_liquids.inputs.settings import MIN_SIMULATIONS, PAPER_RULES

from .calibrations import after_each


def line(theta, seeds):
    """A slope of 2 x, with noise that the seed alone decides."""
    noise = np.stack([np.random.default_rng(int(seed)).normal(0.0, 0.01, 5) for seed in seeds])
    return 2.0 * np.asarray(theta["x"])[:, None] * np.linspace(0.0, 1.0, 5) + noise


def engine():
    prior = inference.Prior({"x": dist.Uniform(0.0, 1.0)})
    observed = 0.6 * np.linspace(0.0, 1.0, 5)
    return inference.Bolfi(prior, observed, seed=3, initial=MIN_SIMULATIONS,
                           surrogate="discrepancy", **PAPER_RULES)  # fmt: skip


@pytest.mark.slow
def test_each_budget_concludes_from_as_many_simulations():
    fits = list(after_each(engine(), line, (5, 9, 12)))
    assert [fit.simulations.sizes["simulation"] for fit in fits] == [5, 9, 12]
    assert abs(fits[-1].best["x"] - 0.3) < 0.05


@pytest.mark.slow
def test_to_look_changes_nothing_where_batches_end_alike():
    rarely, often = (
        list(after_each(engine(), line, budgets))[-1] for budgets in ((12,), (4, 8, 12))
    )
    assert rarely.best == often.best
