"""Simulations that were made before `fit` is called."""

import numpy as np
import pytest

from bolfi_liquids import inference


def test_earlier_simulations_alone_are_confirmed_where_there_is_a_simulator(
    prior, observed, simulate
):
    theta = prior.from_unit(np.random.default_rng(3).uniform(size=(10, 2)))
    signals = simulate(theta, range(10))
    seeds, errors = [*range(10)], ["too hot", *[""] * 9]
    signals[0] = np.nan
    told = theta, signals, seeds, errors
    alone, confirmed = (
        inference.fit(of, prior, observed, budget=0, earlier=told, noise=0.05, confirm=4)
        for of in (None, simulate)
    )
    engine = inference.Bolfi(prior, observed, noise=0.05)
    engine.tell(*told)
    assert alone.best == engine.fit(warn=False).best and alone.confirmed is None
    np.testing.assert_array_equal(confirmed.confirming, [10, 11, 12, 13])
    assert confirmed.confirmed
    assert confirmed.history.errors[0] == "too hot"
    with pytest.raises(ValueError, match=r"errors\[1\]"):
        engine.tell(theta, signals, seeds, ["too hot", "cold", *errors[2:]])
    assert len(np.unique(confirmed.history.seeds)) == 14
