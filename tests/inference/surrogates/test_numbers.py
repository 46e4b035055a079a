"""A table of numbers, learned as discrepancies by `fit` without a simulator."""

import numpy as np
import numpyro.distributions as dist

from bolfi_liquids import inference

PRIOR = inference.Prior({"rate": dist.LogUniform(0.1, 10.0), "size": dist.Uniform(0.0, 2.0)})


def squares(theta, noise):
    """(f(theta) + noise)^2, f a smooth function."""
    return (np.sqrt((np.log(theta["rate"]) + theta["size"]) ** 2 + 1.0) + noise) ** 2


def learned(theta, values):
    """The surrogate of values at theta."""
    return inference.fit(
        None,
        PRIOR,
        np.zeros(1),
        budget=0,
        earlier=(theta, values[:, None]),
        discrepancy=lambda _, value: float(value[0]),
        transform="sqrt",
        warn=False,
    ).surrogate


def test_a_smooth_function_is_learned():
    rng = np.random.default_rng(0)
    theta, new = (
        PRIOR.from_unit(u) for u in (rng.random((60, 2)), 0.1 + 0.8 * rng.random((50, 2)))
    )
    mean, _ = learned(theta, squares(theta, 0.0)).predict(new)
    truth = np.sqrt(squares(new, 0.0))
    assert np.sqrt(np.mean((mean - truth) ** 2)) < 0.02 * truth.std()


def test_the__error_of_a_noisy_number_is_known():
    """RMS of z-scores of new values: sds twice too small or too large would be found.

    Of 200 new values it errs by 0.05, of a noise learned from 60 by 0.09: 1 +- 0.4 is four sds.
    """
    rng = np.random.default_rng(2)
    theta = PRIOR.from_unit(rng.random((60, 2)))
    surrogate = learned(theta, squares(theta, 0.1 * rng.normal(size=60)))
    new = PRIOR.from_unit(0.1 + 0.8 * rng.random((200, 2)))
    mean, sd = surrogate.predict(new)
    z = (np.sqrt(squares(new, 0.1 * rng.normal(size=200))) - mean) / sd
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.4
