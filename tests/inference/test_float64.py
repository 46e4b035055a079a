"""What the engine sets for itself and leaves as it was."""

import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg  # noqa: F401  its BLAS is another than NumPy's
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.criticism.measurement_noise import samples
from threadpoolctl import threadpool_info, threadpool_limits


def blas_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def settings():
    return jnp.asarray(0.1).dtype, np.geterr()["over"], blas_threads()


@in_float64
def inside(fails=False):
    found = in_float64(settings)()
    assert settings() == found  # the inner call has not reset it
    if fails:
        raise ArithmeticError
    return found


def test_settings_hold_inside_and_are_as_before_afterwards():
    with threadpool_limits(2, "blas"), np.errstate(over="raise"):
        before = settings()
        assert inside() == (np.float64, "warn", {1})
        assert settings() == before == (np.float32, "raise", {2})
        with pytest.raises(ArithmeticError):
            inside(fails=True)
        assert settings() == before


def test_the_number_of_processors_changes_no_bit():
    rng = np.random.default_rng(0)
    clean = [np.cumsum(rng.normal(size=(300, 1)), axis=0) for _ in range(3)]
    silent, at = [criticism.KnownNoise(0.1)] * 3, samples(np.zeros(300))
    found = []
    for threads in (1, 2, 4):
        with threadpool_limits(threads, "blas"):
            found.append(criticism.usual_residual(clean, silent, [True] * 3).covariance(at))
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])
