"""Ask and tell: what is asked, what is learned of, and what neither may disturb."""

import copy
import pickle

import jax
import numpy as np
import numpyro.distributions as dist
import pytest

from bolfi_liquids import inference

COMPILED = "backend_compile_duration"


def told(engine, simulate, rounds, n=2):
    for _ in range(rounds):
        theta = engine.ask(n)
        engine.tell(theta, simulate(theta, np.arange(n)))
    return engine


@pytest.mark.slow
def test_asking_depends_only_on_seed_and_history(prior, observed, simulate):
    first = told(inference.Bolfi(prior, observed, seed=3), simulate, 6)
    again = told(inference.Bolfi(prior, observed, seed=3), simulate, 6)
    first.fit()  # looking must not disturb
    left, right = first.ask(3), again.ask(3)
    for name in prior.names:
        np.testing.assert_array_equal(left[name], right[name])


def test_seeds_change_what_is_asked(prior, observed):
    a, b = (inference.Bolfi(prior, observed, seed=s).ask(2)["slope"] for s in (0, 1))
    assert not np.allclose(a, b)


@pytest.mark.slow
def test_pending_points_are_not_asked_again(prior, observed, simulate):
    engine = told(inference.Bolfi(prior, observed), simulate, 5)
    asked = np.concatenate([prior.to_unit(engine.ask(1)) for _ in range(6)])
    distances = np.linalg.norm(asked[:, None] - asked, axis=-1) + np.eye(6)
    assert distances.min() > 1e-3


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:run-to-run noise")  # six runs show but one of two components
def test_told_in_any_order_and_from_elsewhere(prior, observed, simulate):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(4)
    signals = simulate(theta, np.arange(4))
    for i in (2, 0, 3, 1):
        engine.tell({name: v[i] for name, v in theta.items()}, signals[i : i + 1], [i])
    own = {"slope": np.array([0.1, 0.2]), "offset": np.array([0.5, 0.6])}
    engine.tell(own, simulate(own, [7, 8]))
    runs = engine.fit().simulations
    np.testing.assert_array_equal(runs["seed"], [2, 0, 3, 1, -1, -1])
    np.testing.assert_array_equal(runs["round"], [0, 0, 0, 0, -1, -1])


@pytest.mark.slow
def test_a_copy_teaches_nothing(prior, observed, simulate):
    """Copies have equal theta, seed and signal; a replicate, or a run of unknown seed, is none."""
    engine, plain = inference.Bolfi(prior, observed), inference.Bolfi(prior, observed)
    theta = engine.ask(6)
    signals = simulate(theta, np.arange(6))
    for each in (engine, plain):
        each.tell(theta, signals, np.arange(6))
    engine.tell(theta, signals, np.arange(6))
    assert (engine.told, engine.succeeded) == (12, 6)
    fit = engine.fit()
    assert fit.best == plain.fit().best
    np.testing.assert_array_equal(fit.training_mask, np.arange(12) < 6)
    engine.tell(theta, simulate(theta, np.arange(6, 12)), np.arange(6, 12))
    engine.tell(theta, signals)
    assert engine.succeeded == 18


@pytest.mark.slow
def test_failed_runs_count_and_teach_the_emulator_nothing(prior, observed, simulate):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(6)
    signals = simulate(theta, np.arange(6))
    signals[[1, 4]] = np.nan
    engine.tell(theta, signals)
    other = inference.Bolfi(prior, observed)
    good = np.array([0, 2, 3, 5])
    other.tell({n: v[good] for n, v in theta.items()}, signals[good])
    assert (engine.told, engine.succeeded) == (6, 4)
    fit = engine.fit(warn=False)  # of four runs
    np.testing.assert_array_equal(fit.simulations["failed"], [0, 1, 0, 0, 1, 0])
    at = np.array([[0.2, 0.3], [0.7, 0.6]])
    for one, without in zip(
        fit.learned.predict(at), other.fit(warn=False).learned.predict(at), strict=True
    ):
        np.testing.assert_array_equal(one, without)


@pytest.mark.slow
def test_rescaling_a_parameter_changes_nothing(observed, simulate):
    def run(scale):
        prior = inference.Prior(
            {"slope": dist.Uniform(-scale, scale), "offset": dist.Uniform(0.0, 1.0)}
        )
        engine = inference.Bolfi(prior, observed)
        for _ in range(6):
            theta = engine.ask(2)
            natural = {**theta, "slope": theta["slope"] / scale}
            engine.tell(theta, simulate(natural, np.arange(2)))
        return prior.to_unit(engine.fit().best)

    np.testing.assert_allclose(run(1e4), run(1.0), atol=1e-4)  # optimisers stop near 1e-5


@pytest.mark.slow
def test_a_prior_that_fades_out_reaches_the_kernel():
    """A bowl in the parameter itself, least in the prior's tail: over quantiles it is too steep
    there for a stationary kernel."""
    prior = inference.Prior({"a": dist.Normal(0.0, 1.0)})
    theta = prior.from_unit((np.arange(24)[:, None] + 0.5) / 24)
    squared = inference.Bolfi(
        prior, [2.2], discrepancy=lambda a, b: float(np.sum((a - b) ** 2)), transform="identity"
    )
    noise = 0.05 * np.random.default_rng(0).normal(size=(24, 1))
    squared.tell(theta, theta["a"][:, None] + noise)
    fit = squared.fit(warn=False)  # one number leaves the posterior's width to guess
    assert abs(fit.best["a"] - 2.2) < 0.1
    at = prior.to_unit({"a": np.array([2.3, 2.5, 2.7])})  # beyond the last run, 2.04
    np.testing.assert_allclose(fit.learned.predict(at)[0], [0.01, 0.09, 0.25], atol=0.2)


@pytest.mark.parametrize("surrogate", ["signal", "discrepancy"])
def test_asking_and_telling_compile_nothing(prior, observed, simulate, surrogate):
    compiled = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, *_, **__: compiled.append(event) if event.endswith(COMPILED) else None
    )
    engine = inference.Bolfi(prior, observed, surrogate=surrogate)
    for batch in (10, 1, 5):
        theta = engine.ask(batch)
        engine.tell(theta, simulate(theta, np.arange(batch) + engine.told))
    engine.fit(warn=False)  # of 16 runs
    assert not compiled


def test_an_acquisition_is_called_in_float64(prior, observed, simulate):
    seen = []

    def acquire(key, surrogate, n):
        seen.append(jax.numpy.asarray(0.1).dtype)
        return np.full((n, 2), 0.5) + 0.1 * np.arange(n)[:, None] / n

    inference.fit(simulate, prior, observed, budget=6, initial=4, batch=2, acquisition=acquire)
    assert seen == [np.float64]


@pytest.mark.parametrize(
    "options",
    [
        {"noise": 0.05, "summary": np.sort},
        {"discrepancy": inference.squared_difference(np.arange(30.0)), "threshold": 0.3},
    ],
)
def test_a_run_and_its_fit_can_be_pickled(prior, observed, simulate, options):
    engine = inference.Bolfi(prior, observed, **options)
    theta = engine.ask(10)
    engine.tell(theta, simulate(theta, np.arange(10)))
    fit = engine.fit(warn=False)
    again, fit_again = pickle.loads(pickle.dumps((engine, fit)))
    np.testing.assert_array_equal(fit_again.log_prob(theta), fit.log_prob(theta))
    assert (fit_again.warnings, fit_again.best) == (fit.warnings, fit.best)
    left, right = engine.ask(2), again.ask(2)
    for name in prior.names:
        np.testing.assert_array_equal(left[name], right[name])


def test_a_mask_is_a_missing_sample(prior, observed):
    masked = np.ma.masked_array(np.where(np.arange(30) == 4, 1e36, observed), np.arange(30) == 4)
    engine = inference.Bolfi(prior, masked)
    np.testing.assert_array_equal(np.isnan(engine.observed), np.arange(30) == 4)


def test_telling_nothing_changes_nothing(prior, observed):
    engine = inference.Bolfi(prior, observed)
    engine.tell({"slope": [], "offset": []}, [], [], [])
    engine.tell({"slope": [], "offset": []}, np.zeros((0, 30)))
    assert engine.told == 0 and engine.history.failures == {}


@pytest.mark.parametrize(
    ("signals", "got"),
    [(np.ones((50, 3)), r"\(50, 3\)"), ("nonsense", "nonsense"), ([[1.0], [1.0, 2.0]], "1.0")],
)
def test_signals_of_no_theta_are_refused(prior, signals, got):
    engine = inference.Bolfi(prior, np.zeros(3))
    nothing = {name: [] for name in prior.names}
    with pytest.raises(ValueError, match=rf"^signals must be .* \(0, 3\), .*{got}"):
        engine.tell(nothing, signals)
    assert not engine.told


def test_a_copy_and_its_original_go_on_apart(prior, observed, simulate):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(4)
    other = copy.copy(engine)
    engine.tell(theta, simulate(theta, range(4)))
    engine.ask(2)
    assert (other.told, len(other._pending), len(engine._pending)) == (0, 4, 2)
    other.tell(theta, simulate(theta, range(4)))
    np.testing.assert_array_equal(other.history.rounds, np.zeros(4))


def test_what_could_not_be_told_is_still_pending(prior, observed, simulate, monkeypatch):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(2)
    with monkeypatch.context() as broken:
        broken.setattr(type(engine.history), "and_then", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            engine.tell(theta, simulate(theta, range(2)))
    engine.tell(theta, simulate(theta, range(2)))
    np.testing.assert_array_equal(engine.history.rounds, [0, 0])


def test_a_fit_needs_three_successes(prior, observed, simulate):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(3)
    signals = simulate(theta, range(3))
    signals[1] = np.nan
    engine.tell(theta, signals)
    with pytest.raises(ValueError, match="2 of 3 told"):
        engine.fit()
