"""What every surrogate must do, of the engine's families, the example's, and one of your own.

`pytest tests/extensions --family your_module:YourFamily` adds the last to each test.
"""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.acquisition.rules import RULES
from bolfi_liquids.inference.sampling.nuts import padded
from bolfi_liquids.inference.sobol import sobol
from bolfi_liquids.inference.surrogates import Family, Surrogate
from bolfi_liquids.inference.surrogates.families import FAMILIES, checked_surrogate
from bolfi_liquids.inference.surrogates.processes import OfProcesses

from bolfi_liquids import inference

from .named import named
from .quadratic_surface import QuadraticSurface

pytestmark = pytest.mark.filterwarnings(
    "ignore::bolfi_liquids.inference.EmulatorWarning",
    "ignore::bolfi_liquids.inference.SamplingWarning",  # of a handful of draws
)

RUNS = 12
KEYS = [jax.random.key(0), jax.random.key(1)]
POINTS = np.array([[0.2, 0.7], [0.5, 0.5], [0.9, 0.1]])
TIME = np.linspace(0.0, 1.0, 30)
PRIOR = inference.Prior({"slope": dist.Uniform(-1.0, 1.0), "offset": dist.Uniform(0.0, 1.0)})


def simulate(theta, seeds):
    """slope t + offset + noise of sd 0.05 -> [n, 30]."""
    noise = np.stack([np.random.default_rng(seed).normal(0.0, 0.05, TIME.size) for seed in seeds])
    return theta["slope"][:, None] * TIME + theta["offset"][:, None] + noise


OBSERVED = simulate({"slope": np.array([0.3]), "offset": np.array([0.6])}, [12345])[0]


def pytest_generate_tests(metafunc):
    if "family" in metafunc.fixturenames:
        own = metafunc.config.getoption("family", default="")
        names = [*FAMILIES, "example", *([own] if own else [])]
        metafunc.parametrize("family", names, scope="module", indirect=True)


@pytest.fixture(scope="module")
def family(request):
    if request.param in FAMILIES:
        return FAMILIES[request.param]()
    if request.param == "example":
        return QuadraticSurface()
    return named(request.param)()


@pytest.fixture(scope="module")
def fit(family):
    return fitted(family)


def fitted(family):
    u = sobol(0, 0, RUNS, len(PRIOR))
    signals, data = simulate(PRIOR.from_unit(u), range(RUNS)), OBSERVED
    if family.name == "log_likelihood":
        signals, data = -0.5 * np.sum((signals - OBSERVED) ** 2, 1) / 0.05**2, None
    engine = inference.Bolfi(PRIOR, data, surrogate=family)
    engine.tell(PRIOR.from_unit(u), signals, range(RUNS))
    engine.ask(3)  # it searches, too
    return engine.fit()


@pytest.fixture(scope="module")
def learned(fit):
    return fit.learned


def finite(values):
    return bool(np.isfinite(np.asarray(values, float)).all())


def same(a, b):
    return all(np.array_equal(x, y) for x, y in zip(*map(jax.tree.leaves, (a, b)), strict=True))


def check_u(of):
    assert of.u.shape == (RUNS, 2)


def check_log_likelihood(of):
    """A number a point by NumPy; and the same by JAX, padded, as NUTS evaluates it."""
    values = of.log_likelihood(POINTS)
    assert values.shape == (3,) and values.dtype == np.float64 and finite(values)
    assert np.ptp(values) > 0.0
    leaves = jax.tree.leaves(padded(of.log_likelihood))
    assert all(leaf.dtype == np.float64 for leaf in leaves if leaf.dtype.kind == "f")
    with jax.enable_x64(True):
        traced = jax.jit(lambda likelihood, u: likelihood(u))(padded(of.log_likelihood), POINTS)
    np.testing.assert_allclose(traced, values, rtol=1e-9)


def check_log_second_moment(of):
    """E[L^2] >= E[L]^2, up to quadrature; and no run tells more than all there is to know."""
    first, second = of.log_likelihood(POINTS), of.log_second_moment(POINTS)
    assert second.shape == (3,) and finite(second)
    assert (second > 2.0 * first - 1e-3).all()
    resolved = of.log_second_moment(POINTS, POINTS[:2])
    assert resolved.shape == (3, 2) and finite(resolved)
    assert (resolved <= second[:, None] + 1e-3).all()


def check_log_success(of):
    np.testing.assert_array_equal(of.log_success(POINTS), np.zeros(3))  # no run failed


def check_cautious(of):
    """Doubt makes no place more probable to it."""
    first, cautious = (one.log_likelihood(POINTS) for one in (of, of.cautious))
    assert finite(cautious) and (cautious <= first + 1e-9).all()


def check_stated(of):
    """What guards against a wrong model is taken off once."""
    assert finite(of.stated.log_likelihood(POINTS)) and of.stated.stated is of.stated


def check_sure(of):
    assert finite(of.sure(POINTS))


def check_best(of):
    best = of.best()
    assert best.shape == (2,) and ((best >= 0.0) & (best <= 1.0)).all()
    np.testing.assert_array_equal(best, of.best())


def check_fantasize(of):
    """Its own predictions teach it nothing new but certainty."""
    after = of.fantasize(POINTS[:2])
    np.testing.assert_allclose(after.predict(POINTS)[0], of.predict(POINTS)[0], atol=1e-6)
    assert (after.predict(POINTS)[1] <= of.predict(POINTS)[1] + 1e-9).all()
    assert len(after.u) == RUNS + 2 and len(of.u) == RUNS
    assert len(of.fantasize(POINTS[:0]).u) == RUNS
    assert after.checks().keys() == of.checks().keys()
    assert all(len(found) == RUNS for found in after.checks().values())
    assert isinstance(after.warnings(), list)


def check_predict(of):
    mean, sd = of.predict(POINTS)
    assert mean.shape == sd.shape and len(mean) == 3
    assert mean.dtype == sd.dtype == np.float64
    assert finite(mean) and finite(sd) and (sd > 0.0).all()


def check_predicted(of):
    """What three runs would be if they came out as predicted, in the units of `predict`."""
    made = of.predicted(np.ones((3, TIME.size)), np.array([1.0, 2.0, 3.0]))
    assert made.shape == of.predict(POINTS)[0].shape and finite(made)


def check_constants(of):
    assert all(finite(value) for value in of.constants().values())


def check_checks(of):
    assert all(len(found) == RUNS and finite(found) for found in of.checks().values())


def check_fits(of):
    assert isinstance(of.fits, bool)


def check_sentences(of):
    for said in (of.described(), of.unreached, of.warnings(), of.warnings(confirmed=True)):
        assert isinstance(said, list) and all(isinstance(one, str) and one for one in said)


def check_placed(of):
    """Each value once; NaN where nothing was observed."""
    mean = of.predict(POINTS)[0]
    for values in of.placed(mean).values():
        assert len(values) == 3
        np.testing.assert_array_equal(values[np.isfinite(values)], mean.ravel())


def check_pointwise(of):
    """Of a mapping's names, those that were compared have the shape of what was compared."""
    assert of.pointwise(POINTS)
    for name, values in of.pointwise(POINTS).items():
        assert len(values) == 3 and finite(values)
        assert name not in of.compared or values.shape[1:] == of.compared[name].shape


check_compared = check_pointwise


def check_log_constant(of):
    assert finite(of.log_constant) and of.log_variance >= 0.0


def check_realisations(of):
    drawn = of.realisations(np.random.default_rng(0), POINTS, 5)
    assert drawn.shape == (5, len(POINTS))
    assert not np.isnan(drawn).any() or np.isnan(drawn).all()  # where they cannot be drawn


check_log_variance = check_log_constant
check_described = check_unreached = check_warnings = check_sentences


def check_predictive(of):
    first, again, other = (of.predictive(np.random.default_rng(seed), POINTS) for seed in (0, 0, 1))
    for name, values in first.items():
        assert len(values) == 3 and finite(values)
        np.testing.assert_array_equal(values, again[name])
        assert not np.array_equal(values, other[name])


MEMBERS = {*vars(Surrogate), *Surrogate.__annotations__}


def test_a_surrogate_keeps_its_protocol(learned, subtests):
    """A member without a check fails here."""
    for member in sorted(name for name in MEMBERS if not name.startswith("_")):
        with subtests.test(member):
            globals()[f"check_{member}"](learned)
    if isinstance(learned, OfProcesses):  # the engine's own tell of themselves
        assert learned.constants() and learned.described()
        assert set(learned.checks()) == {"loo_z"}
        assert learned.predictive(np.random.default_rng(0), POINTS)


def test_a_surrogate_that_ignores_pending_points_is_noticed():
    learned = fitted(QuadraticSurface()).learned

    class Stubborn(type(learned)):
        def fantasize(self, u):
            return self

    with pytest.raises(AssertionError):
        check_fantasize(Stubborn(learned.u, learned.log_likelihood))


def test_every_rule_chooses_by_it(family, learned, subtests):
    """Different points, the same for a key; "lcb" where the surrogate has a lower bound."""
    assert family.has_lower_bound == hasattr(learned, "lower_bound")
    before = [np.array(leaf) for leaf in jax.tree.leaves(learned.log_likelihood)]
    for name, rule in RULES.items():
        with subtests.test(name):
            if name == "lcb" and not family.has_lower_bound:
                data = None if family.name == "log_likelihood" else OBSERVED
                with pytest.raises(ValueError, match="'lcb' needs"):
                    inference.Bolfi(PRIOR, data, surrogate=family, acquisition=name)
                continue
            u = rule()(KEYS[0], learned, 2)
            assert isinstance(u, np.ndarray) and u.shape == (2, 2) and u.dtype == np.float64
            assert ((u > 0.0) & (u < 1.0)).all() and np.linalg.norm(u[0] - u[1]) > 1e-4
            np.testing.assert_array_equal(u, rule()(KEYS[0], learned, 2))
            assert not np.array_equal(u, rule()(KEYS[1], learned, 2))
    assert same(before, jax.tree.leaves(learned.log_likelihood))  # rules change nothing


def test_what_is_no_family_is_refused_before_it_learns():
    class WithoutBase:
        def learn(self, data, key): ...

    class WithoutKey(Family):
        def learn(self, data): ...

    for given in (WithoutBase(), WithoutKey, WithoutKey()):
        with pytest.raises(ValueError, match="surrogate"):
            inference.Bolfi(PRIOR, OBSERVED, surrogate=given)


def test_the_options_of_a_family_belong_to_the_object_itself():
    for given in (QuadraticSurface(), inference.SignalFamily()):
        with pytest.raises(
            ValueError, match=rf"give noise to {type(given).__name__}\(\.\.\.\) itself"
        ):
            inference.Bolfi(PRIOR, OBSERVED, surrogate=given, noise=0.1)


def test_a_surrogate_may_delegate_to_another():
    class Delegating:
        def __init__(self, inner):
            self.inner = inner

        def __getattr__(self, name):
            return getattr(self.inner, name)

    found = Delegating(fitted(QuadraticSurface()).learned)
    assert checked_surrogate(found, QuadraticSurface()) is found


def test_what_is_no_surrogate_is_refused_with_what_is_missing():
    """Where it searches and where it fits, of a class derived from `Surrogate` or not."""
    found = fitted(QuadraticSurface()).learned

    class Abstract(Surrogate):
        u, best, predict = found.u, found.best, found.predict

    class Unfinished(Abstract):
        fantasize = found.fantasize

    with pytest.raises(TypeError, match="fantasize"):
        Abstract()

    class Odd(type(QuadraticSurface())):
        def learn(self, data, key):
            return returned

    for returned, missing in {None: "best.*warnings", Unfinished(): "log_likelihood"}.items():
        engine = inference.Bolfi(PRIOR, OBSERVED, surrogate=Odd(), initial=3)
        engine.tell(PRIOR.from_unit(POINTS), simulate(PRIOR.from_unit(POINTS), range(3)))
        for act in (engine.fit, engine.ask):
            with pytest.raises(ValueError, match=f"{type(returned).__name__} without .*{missing}"):
                act()


def test_a_family_cannot_change_the_signals_that_it_measures():
    class Writing(type(QuadraticSurface())):
        def measure(self, observed, signals):
            for signal in signals:
                signal[:] = 0.0
            return super().measure(observed, signals)

    signals = simulate(PRIOR.from_unit(POINTS), range(3))
    for told in (signals, list(signals)):
        engine = inference.Bolfi(PRIOR, OBSERVED, surrogate=Writing())
        with pytest.raises(ValueError, match="read-only"):
            engine.tell(PRIOR.from_unit(POINTS), told)
    assert signals.flags.writeable and signals.all()


def test_a_fit_rests_on_it(fit, family):
    """It is described, and sampled without a compiler."""
    name = family.name or type(family).__name__
    assert name in str(fit)
    drawn = fit.sample("quadrature", chains=2, draws=50, warn=False)
    assert finite(drawn["posterior"]["slope"]) and drawn.attrs["surrogate"] == name
    assert set(drawn["emulator_checks"]) == set(fit.learned.checks())


@pytest.mark.slow
def test_the_example_finds_the_line_and_nuts_follows_it():
    options = {"budget": 12, "surrogate": QuadraticSurface(), "progress": False}
    drawn = inference.fit(simulate, PRIOR, OBSERVED, **options).sample(draws=200, warmup=200)
    for name, truth in {"slope": 0.3, "offset": 0.6}.items():
        values = drawn["posterior"][name]
        assert abs(values.mean() - truth) < 4.0 * values.std()
        assert values.std() < 0.1
