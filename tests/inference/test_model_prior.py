"""Priors that are numpyro models: beside numpyro's own draws and densities, and closed forms."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
import pytest
from numpyro import handlers
from numpyro.infer import Predictive
from numpyro.infer.util import log_density
from scipy import stats

from bolfi_liquids import inference

GROUPS, SD = 3, 0.5


def chain():
    """Each depends on what is before it, in its bounds, its place, its width and its shape."""
    a = numpyro.sample("a", dist.LogUniform(0.1, 10.0))
    b = numpyro.sample("b", dist.Uniform(-a, a))
    c = numpyro.sample("c", dist.TruncatedNormal(b, 1.0, low=0.0))
    numpyro.deterministic("sum", a + b)
    d = numpyro.sample("d", dist.Weibull(jnp.exp(0.3 * b), 1.0 + a))
    numpyro.sample("e", dist.Normal(c, jnp.sqrt(d)))


def groups():
    mean = numpyro.sample("mean", dist.Normal(0.0, 2.0))
    for j in range(GROUPS):
        numpyro.sample(f"group_{j}", dist.Normal(mean, 1.0))


def independent():
    for name, distribution in INDEPENDENT.items():
        numpyro.sample(name, distribution)


INDEPENDENT = {"x": dist.LogUniform(1e-3, 20.0), "y": dist.HalfNormal(2.0), "z": dist.Uniform(0, 1)}


@pytest.fixture(scope="module")
def prior():
    return inference.Prior(chain)


@pytest.fixture(scope="module")
def drawn():
    with jax.enable_x64(True):
        draws = Predictive(chain, num_samples=4000)(jax.random.key(1))
    return {name: np.asarray(values) for name, values in draws.items() if name != "sum"}


def projections(theta):
    """Marginals, and what shows how parameters depend on one another."""
    of_one = list(theta.values())
    return [*of_one, theta["b"] / theta["a"], theta["c"] - theta["b"], theta["e"] - theta["c"]]


def test_draws_are_those_of_numpyro(prior, drawn):
    assert prior.names == ("a", "b", "c", "d", "e") and len(prior) == 5
    ours = prior.sample(jax.random.key(2), 4000)
    for one, other in zip(projections(ours), projections(drawn), strict=True):
        assert stats.ks_2samp(one, other).pvalue > 1e-4
    # parameters that were drawn for other ones would be seen
    mixed = {**ours, "b": np.roll(ours["b"], 1)}
    worst = [
        stats.ks_2samp(*pair).pvalue
        for pair in zip(projections(mixed), projections(drawn), strict=True)
    ]
    assert min(worst) < 1e-4


def test_quantiles_of_numpyro_s_draws_are_uniform_and_independent(prior, drawn):
    u = prior.to_unit(drawn)
    for column in u.T:
        assert stats.kstest(column, "uniform").pvalue > 1e-4
    correlations = stats.spearmanr(u).statistic[np.triu_indices(5, 1)]
    assert (np.abs(correlations) * np.sqrt(len(u)) < 4.5).all()


@pytest.mark.parametrize("shape", [(5,), (1, 5), (300, 5), (3, 4, 5)])
def test_parameters_return_from_their_quantiles(prior, shape):
    u = np.random.default_rng(0).random(shape)
    theta = prior.from_unit(u)
    assert all(values.shape == shape[:-1] for values in theta.values())
    if len(shape) < 3:
        np.testing.assert_allclose(prior.to_unit(theta), u, atol=1e-9)
        assert np.all(prior.contains(theta))


def test_at_the_corners_of_the_box_everything_is_finite(prior):
    u = np.stack(np.meshgrid(*[[0.0, 1.0]] * 5), -1).reshape(-1, 5)
    theta = prior.from_unit(u)
    assert np.isfinite(prior.log_prob(theta)).all() and prior.contains(theta).all()
    assert np.isfinite(prior.to_unit(theta)).all()


def test_density_is_that_of_numpyro(prior, drawn):
    rows = [{name: values[i] for name, values in drawn.items()} for i in range(8)]
    with jax.enable_x64(True):
        expected = [log_density(chain, (), {}, row)[0] for row in rows]
    found = prior.log_prob({name: values[:8] for name, values in drawn.items()})
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_outside_of_what_the_others_allow_the_density_vanishes(prior):
    inside = {"a": 1.0, "b": 0.5, "c": 1.0, "d": 1.0, "e": 0.0}
    assert prior.contains(inside) and np.isfinite(prior.log_prob(inside))
    for outside in ({"b": 1.5}, {"a": 0.3}, {"c": -0.1}, {"a": -1.0}, {"a": 20.0, "b": 0.0}):
        assert not prior.contains(inside | outside)
        assert prior.log_prob(inside | outside) == -np.inf
    told = {name: [value] * 3 for name, value in inside.items()} | {"b": [0.5, 1.5, 0.5]}
    with pytest.raises(ValueError, match="theta must lie in the support .* row 1"):
        inference.Bolfi(prior, [0.0]).tell(told, np.zeros((3, 1)))


def test_a_model_of_independent_parameters_is_their_mapping():
    of_model, of_mapping = inference.Prior(independent), inference.Prior(INDEPENDENT)
    u = np.random.default_rng(0).random((200, 3))
    theta = of_mapping.from_unit(u)
    for name, values in of_model.from_unit(u).items():
        np.testing.assert_array_equal(values, theta[name])
    np.testing.assert_array_equal(of_model.to_unit(theta), of_mapping.to_unit(theta))
    np.testing.assert_array_equal(of_model.log_prob(theta), of_mapping.log_prob(theta))
    np.testing.assert_array_equal(of_model.tails, of_mapping.tails)
    assert of_model.describe() == of_mapping.describe() and repr(of_model) == repr(of_mapping)


def triangle():
    a = numpyro.sample("a", dist.Beta(1.0, 2.0))
    numpyro.sample("b", dist.Uniform(0.0, 1.0 - a))


def test_a_constraint_may_leave_the_density_uniform():
    prior, theta = inference.Prior(triangle), np.random.default_rng(0).random((2, 200))
    inside = theta.sum(0) < 1.0
    density = np.exp(prior.log_prob({"a": theta[0], "b": theta[1]}))
    np.testing.assert_allclose(density, np.where(inside, 2.0, 0.0), rtol=1e-6)


def test_threads_do_not_mix_their_models(prior):
    u = np.random.default_rng(0).random((50, 5))
    other = inference.Prior(groups)
    with ThreadPoolExecutor(4) as pool:
        found = list(
            pool.map(lambda i: (prior, other)[i % 2].from_unit(u[:, : 5 - i % 2]), range(40))
        )
    for i, theta in enumerate(found):
        for name, values in (prior, other)[i % 2].from_unit(u[:, : 5 - i % 2]).items():
            np.testing.assert_array_equal(theta[name], values)


def test_what_it_says_of_itself_and_its_copy(prior):
    said = inference.Prior(groups, units={"mean": "m"}).describe()
    assert said["mean"] == {"prior": "Normal(loc=0, scale=2)", "units": "m"}
    assert said["group_0"] == {"prior": "Normal(loc=0, scale=1) given mean=0"}
    copy, u = pickle.loads(pickle.dumps(prior)), np.full(5, 0.3)
    assert copy.from_unit(u) == prior.from_unit(u)
    with pytest.raises(ValueError, match="prior must have independent parameters"):
        _ = prior.distributions


def a_factor():
    a = numpyro.sample("a", dist.Uniform(0.0, 1.0))
    numpyro.factor("small", -a)


def an_observation():
    numpyro.sample("a", dist.Normal(numpyro.sample("b", dist.Normal()), 1.0), obs=0.5)


def a_plate():
    with numpyro.plate("groups", 3):
        numpyro.sample("a", dist.Normal())


def a_vector():
    numpyro.sample("a", dist.Normal(jnp.zeros(3), 1.0))


def a_shape():
    numpyro.sample("a", dist.Normal(), sample_shape=(3,))


def a_key():
    numpyro.sample("a", dist.Uniform(0.0, jax.random.uniform(numpyro.prng_key())))


def a_transform():
    a = numpyro.sample("a", dist.Uniform(0.0, 1.0))
    moved = dist.transforms.AffineTransform(a, 1.0 + a)
    numpyro.sample("b", dist.TransformedDistribution(dist.Normal(), moved))


def a_parameter():
    numpyro.sample("a", dist.Normal(numpyro.param("place", 0.0), 1.0))


def a_branch():
    a = numpyro.sample("a", dist.Uniform(0.0, 1.0))
    numpyro.sample("b", dist.Normal() if a < 0.5 else dist.Uniform(0.0, 1.0))


def a_late_beginning():
    a = numpyro.sample("a", dist.Uniform(0.0, 1.0))
    numpyro.sample("b", dist.Uniform(0.3, a))


def a_rarely_late_beginning():
    a = numpyro.sample("a", dist.Normal(0.0, 0.2))
    numpyro.sample("b", dist.Uniform(a, 1.0))


def a_number_of_the_first():
    a = numpyro.sample("a", dist.Uniform(0.0, 1.0))
    numpyro.sample("b", dist.Normal(np.ravel(a)[0], 1.0))


def a_whole_number():
    numpyro.sample("a", dist.Poisson(3.0))


def the_same_twice():
    numpyro.sample("a", dist.Normal())
    numpyro.sample("a", dist.Normal())


@pytest.mark.parametrize(
    ("model", "told"),
    [
        (a_factor, "scalar parameters alone, got the sample 'small'.* truncated distribution"),
        (an_observation, "scalar parameters alone, got the sample 'a'.* for `fit`"),
        (a_plate, "got the plate 'groups'.* a loop"),
        (a_shape, "got the sample 'a'.* a shape"),
        (handlers.scale(chain, 0.5), "got the sample 'a'.* a scale"),
        (handlers.substitute(chain, {"b": 0.1}), "got the sample 'b'.* whose value is set"),
        (a_key, "got the prng_key"),
        pytest.param(a_transform, "NotImplementedError of numpyro", marks=pytest.mark.slow),
        (a_parameter, "got the param 'place'"),
        (a_vector, r"'a' must be univariate with shape \(\), got \(3,\)"),
        (a_branch, r"take arrays \[n\].*jnp.where"),
        (a_late_beginning, "proper distributions .*order of bounds"),
        (a_rarely_late_beginning, "proper distributions .*order of bounds"),
        (a_number_of_the_first, "others than for numbers"),
        (a_whole_number, "'a' must be continuous"),
        (the_same_twice, "name each parameter once, got 'a'"),
        (lambda: None, "at least one parameter"),
        (lambda a: None, r"distributions must be called with \(\)"),
    ],
)
def test_models_that_are_no_prior_are_refused_with_the_cure(model, told):
    with pytest.raises(ValueError, match=told):
        inference.Prior(model)


@pytest.mark.slow
def test_the_posterior_of_a_hierarchy_is_its_closed_form():
    """Means of groups around their common mean, each seen once: all is Gaussian."""

    def simulate(theta, seeds):
        return np.stack([theta[f"group_{j}"] for j in range(GROUPS)], -1)

    observed = np.array([1.5, 0.2, -0.8])
    fit = inference.fit(
        simulate, inference.Prior(groups), observed, budget=40, noise=SD, progress=False, warn=False
    )
    own = np.concatenate([np.ones((GROUPS, 1)), np.eye(GROUPS)], 1)  # group = mean + own
    design = np.concatenate([np.eye(1, GROUPS + 1), own])
    prior_cov = np.diag([4.0, *[1.0] * GROUPS])
    gain = prior_cov @ own.T @ np.linalg.inv(own @ prior_cov @ own.T + SD**2 * np.eye(GROUPS))
    mean, cov = design @ gain @ observed, design @ (prior_cov - gain @ own @ prior_cov) @ design.T
    drawn = fit.sample("emcee", draws=500, warn=False)["posterior"]
    theta = np.stack([drawn[name].to_numpy().ravel() for name in fit.prior.names])
    sd = np.sqrt(np.diag(cov))
    assert (np.abs(theta.mean(1) - mean) < 0.15 * sd).all()
    assert (np.abs(np.log(theta.std(1) / sd)) < 0.15).all()
    assert np.abs(np.corrcoef(theta) - cov / np.outer(sd, sd)).max() < 0.1
