"""Samplers against analytic posteriors and quadrature; what happens when they fall short."""

import numpy as np
import pytest
from arviz_stats.base import array_stats
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.gp.namespaces import log_sum_exp, namespace
from bolfi_liquids.inference.sampling import draw as sampling
from bolfi_liquids.inference.sampling import nuts, quadrature
from bolfi_liquids.inference.sampling.convergence import ConvergenceStatus, limits
from bolfi_liquids.inference.sampling.target import Chains, Length, Target
from jax.tree_util import Partial
from scipy.stats import norm

from bolfi_liquids import inference

ALPHA = 1e-4  # false alarms per test
NAMES = ("a", "b", "c", "d")
LENGTH = Length(chains=4, warmup=200, draws=1000)
SMALL = Length(chains=4, warmup=100, draws=64)

draw_posterior = in_float64(sampling.draw_posterior)


def peaks(state, u):
    """Gaussians of weights 0.8 and 0.2, where they coincide one, along a parabola."""
    centres, whiteners, bend = state
    xp = namespace(u)
    last = np.eye(u.shape[1])[-1]
    bent = u - bend * (u[:, :1] - 0.5) ** 2 * last
    z = xp.einsum("kij,nkj->nki", whiteners, bent[:, None] - centres)
    return log_sum_exp(np.log([0.8, 0.2]) - 0.5 * xp.sum(z**2, -1))


def one(centre, whitener, bend=0.0):
    """A single Gaussian; one likelihood for all tests saves compiling others."""
    state = np.stack([centre] * 2), np.stack([whitener] * 2), np.asarray(bend)
    return Target(Partial(peaks, state), len(centre))


def gaussian(d, sd=0.03):
    """Correlation 0.95 between neighbouring parameters."""
    index = np.arange(d)
    covariance = sd**2 * 0.95 ** np.abs(index[:, None] - index)
    return one(np.full(d, 0.45), np.linalg.inv(np.linalg.cholesky(covariance)))


def bimodal(d, sd=0.03):
    """Modes 17 sd apart in each parameter."""
    centres = np.stack([np.full(d, 0.25), np.full(d, 0.75)])
    state = centres, np.stack([np.eye(d) / sd] * 2), np.asarray(0.0)
    return Target(Partial(peaks, state), d)


def banana():
    return one(np.array([0.5, 0.4]), np.diag([1 / 0.2, 1 / 0.02]), bend=2.0)


def uncorrelated():
    return one(np.full(2, 0.45), np.eye(2) / 0.03)


TARGETS = {"uncorrelated": uncorrelated, "bimodal": lambda: bimodal(2)}


def sample(sampler, target, length=LENGTH, seed=1, extend=8):
    return draw_posterior(sampler, target, NAMES[: target.dimension], length, seed, extend)


def z_scores(values, truth):
    """Errors of the means of values [chain, draw, k] in Monte Carlo standard errors."""
    mcse = np.array([array_stats.mcse(values[..., j]) for j in range(values.shape[-1])])
    return np.abs(values.mean((0, 1)) - truth) / mcse


def assert_means(values, truth):
    z = z_scores(values, truth)
    assert (z < norm.ppf(1 - ALPHA / (2 * z.size))).all(), z


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["nuts", "emcee"])
@pytest.mark.parametrize("d", [1, 4])
def test_moments_of_a_correlated_gaussian(sampler, d):
    """Means and variances; a twin shifted by 0.3 sd must fail: with 2000 effective draws it is
    13 standard errors off, where the bound is 4.5."""
    made = sample(sampler, gaussian(d))
    u = made.chains.u
    assert not made.found
    assert_means(np.concatenate([u, (u - 0.45) ** 2], -1), np.repeat([0.45, 0.03**2], d))
    assert (z_scores(u + 0.3 * 0.03, np.full(d, 0.45)) > 5.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["nuts", "emcee"])
@pytest.mark.parametrize("d", [1, 4])
def test_shares_of_modes_that_no_path_connects(sampler, d):
    """Chains that stay in the modes they start in give quarters, and R-hat far above 1.01. The
    twin: modes taken for equally likely are 15 standard errors off with 1000 effective draws."""
    made = sample(sampler, bimodal(d))
    first = (made.chains.u[..., :1] < 0.5).astype(float)
    assert not made.found
    assert_means(first, 0.8)
    assert (z_scores(first, 0.5) > 10.0).all()
    assert (first.mean(1) < 1.0).all() and (first.mean(1) > 0.0).all()  # each chain in both
    within = made.chains.u[first[..., 0] > 0.5]
    np.testing.assert_allclose(within.std(0), 0.03, rtol=0.1)


@pytest.mark.slow
def test_a_posterior_at_the_border_and_an_open_direction():
    """Half a Gaussian of sd 0.02 at u = 0, and nothing known of the other parameter."""
    made = sample("nuts", one(np.array([0.0, 0.5]), np.diag([1 / 0.02, 1e-3])))
    assert_means(made.chains.u, [0.02 * np.sqrt(2.0 / np.pi), 0.5])
    assert_means(made.chains.u**2, [0.02**2, 1 / 3])


def test_an_option_that_xla_does_not_know_is_left_out(monkeypatch):
    monkeypatch.setattr(nuts, "XLA_OPTIONS", {"xla_cpu_of_another_version": False})
    assert callable(nuts._compiled_run.__wrapped__())


@pytest.mark.slow
def test_compiles_once_for_all_fits_and_lengths(line_fit, prior, observed, simulate):
    traces = []

    def counted(state, u):
        if not isinstance(u, np.ndarray):  # NumPy evaluates it without compiling
            traces.append(None)
        return state(u)

    counts = []
    short = inference.fit(simulate, prior, observed, budget=7, surrogate="discrepancy", warn=False)
    for fit, draws in ((short, 30), (line_fit, 30), (line_fit, 400)):  # data and padding differ
        target = Target(Partial(counted, fit.learned.log_likelihood), 2)
        source = in_float64(nuts.sample_nuts)(
            np.random.default_rng(0), target, Length(4, 20, draws)
        )
        for _ in range(2):  # its continuation as well
            in_float64(next)(source)
        counts.append(len(traces))
    assert counts[0] > 0
    assert counts[2] == counts[1] == counts[0]


@pytest.mark.slow
@pytest.mark.parametrize("known", [np.asarray, lambda u: np.array([[float(u[0, 0]), 0.5]])])
def test_a_likelihood_of_numpy_alone_is_refused_by_nuts_and_not_by_emcee(known):
    target = Target(lambda u: -0.5 * np.sum(((known(u) - 0.45) / 0.03) ** 2, 1) + 0.0 * u[:, 0], 2)
    with pytest.raises(ValueError, match="'nuts' needs"):
        sample("nuts", target, SMALL)
    if known is np.asarray:
        assert not sample("emcee", target).found


@pytest.mark.slow
@pytest.mark.parametrize("sampler", sampling.SAMPLERS)
def test_seeds_fix_the_draws_and_what_is_finite_nowhere_is_refused(sampler):
    a, b, c = (sample(sampler, gaussian(2), SMALL, seed).chains.u for seed in (0, 0, 1))
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, c)
    with pytest.raises(ValueError, match="finite nowhere"):
        sample(sampler, one(np.full(2, 0.5), np.full((2, 2), np.nan)), SMALL)


def slow(rng, target, length):
    """Independent Gaussian chains with autocorrelation 0.97, about a thirtieth as effective."""
    x = rng.normal(size=(length.chains, 2))
    while True:
        kept = []
        for _ in range(length.draws):
            x = 0.97 * x + np.sqrt(1.0 - 0.97**2) * rng.normal(size=x.shape)
            kept.append(x)
        yield Chains(0.45 + 0.03 * np.stack(kept, 1), {})


def stuck(rng, target, length):
    """Half the chains in either mode."""
    modes = np.where(np.arange(length.chains) % 2, 0.25, 0.75)[:, None, None]
    while True:
        yield Chains(modes + 0.03 * rng.normal(size=(length.chains, length.draws, 2)), {})


def biased(rng, target, length):
    """Independent draws of the wrong posterior."""
    while True:
        yield Chains(0.47 + 0.03 * rng.normal(size=(length.chains, length.draws, 2)), {})


def divergent(rng, target, length):
    shape = (length.chains, length.draws)
    while True:
        share = rng.random(shape) < 0.05
        yield Chains(
            next(quadrature.sample_quadrature(rng, target, length)).u, {"diverging": share}
        )


def test_goes_on_until_it_suffices(monkeypatch):
    """3600 draws are worth 30 each time round; eight times as many, thinned, suffice."""
    monkeypatch.setitem(sampling.SAMPLERS, "slow", slow)
    made = sample("slow", uncorrelated(), Length(4, 1, 3600))
    assert not made.found
    assert made.steps > 3600
    assert made.chains.u.shape == (4, 3600, 2)


@pytest.mark.parametrize(
    ("sampler", "target", "extend", "found", "said"),
    [
        (slow, "uncorrelated", 2, ConvergenceStatus.TOO_FEW_DRAWS, "2000"),
        (stuck, "bimodal", 2, ConvergenceStatus.TOO_FEW_DRAWS, "R-hat"),
        # shifted by 0.7 sd, while R-hat and ESS are perfect
        (biased, "uncorrelated", 8, ConvergenceStatus.QUADRATURE_DIFFERS, "total variation 0."),
        (divergent, "uncorrelated", 8, ConvergenceStatus.DIVERGENT, "5."),
    ],
    ids=lambda one: getattr(one, "__name__", None),
)
def test_draws_that_fall_short_are_not_silent(monkeypatch, sampler, target, extend, found, said):
    monkeypatch.setitem(sampling.SAMPLERS, "planted", sampler)
    made = sample("planted", TARGETS[target](), extend=extend)
    assert found in made.found and said in made.status
    if sampler is not stuck:  # these differ from quadrature, too
        assert [*made.found] == [found]
    assert made.steps == (2000 if found is ConvergenceStatus.TOO_FEW_DRAWS else 1000)


@pytest.mark.slow
def test_a_hole_in_the_likelihood_is_avoided_or_told():
    """NaN wherever u_1 < 0.45: half of the Gaussian remains, which emcee samples; trajectories
    break off at the edge, which NUTS must say."""
    target = Target(Partial(right_half, *uncorrelated().log_likelihood.args), 2)
    made = sample("emcee", target)
    assert not made.found
    assert_means(made.chains.u, [0.45 + 0.03 * np.sqrt(2.0 / np.pi), 0.45])
    assert ConvergenceStatus.DIVERGENT in sample("nuts", target).found


def right_half(state, u):
    return namespace(u).where(u[:, 0] < 0.45, np.nan, peaks(state, u))


@pytest.mark.parametrize(("chains", "draws"), [(2, 8), (4, 400)])
def test_independent_draws_pass_the_limits(chains, draws):
    """At most one false alarm per 400 would fail with probability 0.01; chains half a standard
    deviation apart are caught from 400 draws on."""
    rng = np.random.default_rng(0)
    rhat, ess = limits(chains, draws)

    def short(x):
        return array_stats.rhat(x) > rhat or array_stats.ess(x, method="bulk") < ess

    assert sum(short(rng.normal(size=(chains, draws))) for _ in range(200)) <= 3
    if draws >= 400:
        apart = 0.5 * np.arange(chains)[:, None]
        assert all(short(apart + rng.normal(size=(chains, draws))) for _ in range(20))


@pytest.mark.slow
@pytest.mark.parametrize("sampler", sampling.SAMPLERS)
@pytest.mark.parametrize("posterior", ["a banana", "a fit"])
def test_agrees_with_quadrature(line_fit, sampler, posterior):
    """Sixteen equally probable bins: 4000 independent draws differ by 0.025, 1000 by 0.05."""
    target = banana() if posterior == "a banana" else Target(line_fit.learned.log_likelihood, 2)
    made = sample(sampler, target, seed=2)
    cells = in_float64(quadrature.integrate)(target, quadrature.THOROUGH_BUDGET)
    assert not made.found
    assert quadrature.total_variation(made.chains.u.reshape(-1, 2), cells) < 0.05
    assert_means(made.chains.u, cells.mass @ (cells.low + 0.5 * cells.width[:, None]))


def test_log_prob_is_prior_times_likelihood(line_fit):
    theta = {"slope": np.array([0.2, 0.9, 2.0]), "offset": np.array([0.7, 0.1, 0.5])}
    values = line_fit.log_prob(theta)
    inside = {name: v[:2] for name, v in theta.items()}
    # Phi((eps - mu) / sigma), what is not known of mu beyond the resolution counting against it
    learned, (mean, sd) = line_fit.learned, line_fit.surrogate.predict(inside)
    noise = learned.scale.spread * np.exp(learned.gp.hyper.log_noise[0])
    latent, resolution = sd**2 - noise**2, learned.resolution**2
    counted = latent * resolution / (latent + resolution)
    sigma = np.sqrt(counted + noise**2 + learned.width**2)
    z = (learned.threshold - mean - np.sqrt(latent - counted)) / sigma
    np.testing.assert_allclose(values[:2], np.log(0.5) + norm.logcdf(z), rtol=1e-6)
    assert values[2] == -np.inf
    assert line_fit.log_prob({"slope": 0.2, "offset": 0.7}).shape == ()
