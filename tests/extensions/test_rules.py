"""What every acquisition rule must do, of the example's, and one of your own; and of the engine's,
of which `test_surrogates.py` asks the rest with each surrogate.

`pytest tests/extensions --rule your_module:YourRule` adds the last to each test.
"""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.acquisition.rules import RULES
from bolfi_liquids.inference.sobol import sobol
from bolfi_liquids.inference.surrogates.discrepancy import learn, with_threshold

from bolfi_liquids import inference

from .least_known import LeastKnown
from .named import named

KEY, OTHER = jax.random.key(0), jax.random.key(1)
PRIOR = inference.Prior({"a": dist.Uniform(0.0, 1.0), "b": dist.Uniform(0.0, 1.0)})
TRUTH = 0.4


def pytest_generate_tests(metafunc):
    own = metafunc.config.getoption("rule", default="")
    names = ["example", *([own] if own else [])]
    engines = [] if "learned" in metafunc.fixturenames else [*RULES]
    metafunc.parametrize("rule", [*engines, *names], indirect=True)


@pytest.fixture
def rule(request):
    if request.param in RULES:
        return RULES[request.param]()
    return (LeastKnown if request.param == "example" else named(request.param))()


@pytest.fixture(scope="module")
def learned():
    """A discrepancy that is least at TRUTH in both parameters."""
    u = sobol(0, 0, 16, 2)
    noise = 0.05 * np.random.default_rng(0).normal(size=16)
    return with_threshold(learn(u, 1.0 + ((u - TRUTH) ** 2).sum(-1) + noise, "identity"), None)


def test_points_are_prior_quantiles_that_differ(rule, learned):
    for n in (1, 4):
        u = rule(KEY, learned, n)
        assert u.shape == (n, 2) and u.dtype == np.float64
        assert ((u > 0.0) & (u < 1.0)).all()
        assert len(np.unique(u, axis=0)) == n


def test_the_key_decides(rule, learned):
    np.testing.assert_array_equal(rule(KEY, learned, 3), rule(KEY, learned, 3))
    assert not np.array_equal(rule(KEY, learned, 3), rule(OTHER, learned, 3))


def test_it_changes_nothing(rule, learned):
    before = jax.tree.map(np.array, learned.log_likelihood)
    rule(KEY, learned, 2)
    for old, now in zip(*map(jax.tree.leaves, (before, learned.log_likelihood)), strict=True):
        np.testing.assert_array_equal(old, now)


@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.EmulatorWarning")
def test_its_points_find_the_truth(rule):
    """Of a line whose offset and slope are seen with little noise, by the paper's surrogate."""

    def simulate(theta, seeds):
        return theta["a"][:, None] + theta["b"][:, None] * np.linspace(0.0, 1.0, 8)

    observed = simulate({"a": np.array([TRUTH]), "b": np.array([TRUTH])}, [0])[0]
    made = inference.fit(
        simulate, PRIOR, observed, budget=24, surrogate="discrepancy", acquisition=rule,
        seed=0, confirm=0, progress=False, warn=False,
    )  # fmt: skip
    for name in PRIOR.names:
        assert abs(made.best[name] - TRUTH) < 0.1
