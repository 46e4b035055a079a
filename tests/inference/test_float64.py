"""What the engine sets for itself and leaves as it was."""

import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
import scipy.linalg  # noqa: F401  its BLAS is another than NumPy's
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.criticism.measurement_noise import samples
from threadpoolctl import ThreadpoolController, threadpool_limits

from bolfi_liquids import inference

PATIENCE = 30.0  # s


# other packages bring a BLAS along, which the engine does not call
BLAS = [
    library
    for library in ThreadpoolController().select(user_api="blas").lib_controllers
    if "numpy" in library.filepath or "scipy" in library.filepath
]


def blas_threads():
    return {library.num_threads for library in BLAS}


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


def test_threads_that_leave_in_another_order_leave_blas_as_it_was():
    """The first that entered leaves while the second is inside, and the other way round."""
    entered, first_left = Event(), Event()

    @in_float64
    def first():
        second = pool.submit(of_the_second)
        assert entered.wait(PATIENCE)
        return second

    @in_float64
    def of_the_second():
        entered.set()
        assert first_left.wait(PATIENCE)
        return blas_threads()

    with threadpool_limits(2, "blas"), ThreadPoolExecutor() as pool:
        second = pool.submit(first).result()
        first_left.set()
        assert second.result() == {1}
        assert blas_threads() == {2}
        for _ in range(20):
            assert all(
                found == {1} for found in pool.map(in_float64(lambda _: blas_threads()), "abcd")
            )
        assert blas_threads() == {2}


def test_the_number_of_blas_threads_changes_no_bit():
    rng = np.random.default_rng(0)
    clean = [np.cumsum(rng.normal(size=(300, 1)), axis=0) for _ in range(3)]
    clean = [criticism.CleanData(one, criticism.KnownNoise(0.1)) for one in clean]
    at = samples(np.zeros(300))
    found = []
    for threads in (1, 2, 4):
        with threadpool_limits(threads, "blas"):
            found.append(criticism.learned_model_error(clean).covariance(at))
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


TIME = np.linspace(0.0, 4.0, 40)
LAPACK = ("cholesky", "eigh", "inv", "lstsq", "slogdet", "solve", "solve_triangular", "svd")


def ringing(theta, seeds):
    late = theta.get("late", np.zeros(len(seeds)))
    noise = [np.random.default_rng(int(seed)).normal(0.0, 0.02, TIME.size) for seed in seeds]
    shape = np.exp(-theta["rate"][:, None] * TIME)
    return shape * np.cos(5.0 * (TIME - late[:, None])) + noise


@pytest.fixture
def counted(monkeypatch):
    """Calls of LAPACK by NumPy and SciPy in the engine, and how many threads each had."""
    calls = []

    def counting(name, function):
        def call(*args, **kwargs):
            calls.append((name, blas_threads()))
            return function(*args, **kwargs)

        return call

    assert criticism.criticise and criticism.learned_model_error  # their modules are loaded lazily
    places = [m for name, m in sys.modules.items() if name.startswith("bolfi_liquids.inference")]
    for place in (np.linalg, *places):
        for name in LAPACK:
            function = vars(place).get(name)
            if getattr(function, "__module__", "").startswith(("numpy", "scipy")):
                monkeypatch.setattr(place, name, counting(name, function))
    return calls


@pytest.mark.slow
def test_whatever_the_engine_solves_is_solved_by_one_thread(counted):
    prior = inference.Prior({"rate": dist.LogUniform(0.1, 3.0)})
    observed = ringing({"rate": np.array([0.7]), "late": np.array([0.1])}, [7])[0]
    kernel = 0.05**2 * (np.eye(40) + np.exp(-np.abs(np.subtract.outer(TIME, TIME))))
    noise = criticism.AutoregressiveNoise(np.array([0.05]), np.array([0.3]))
    with threadpool_limits(2, "blas"):
        fit = inference.fit(
            ringing, prior, observed, surrogate="signal", noise=kernel, budget=8, warn=False
        )
        fit.sample("quadrature")
        criticism.criticise(
            criticism.Experiment(ringing, observed, noise),
            prior,
            {"late": criticism.Extension(dist.Uniform(-0.3, 0.3))},
            plan=criticism.Plan(start=8, base=8, extension=8, refit=8),
        )
    assert {"cholesky", "eigh", "solve", "solve_triangular", "svd"} <= {name for name, _ in counted}
    assert [name for name, threads in counted if threads != {1}] == []
