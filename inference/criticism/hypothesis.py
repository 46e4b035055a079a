"""A model, base or extended, fitted to data: what is left, how large that may be, and what it says
of the parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh, solve_triangular
from scipy.special import logsumexp, ndtr

from .._float64 import in_float64
from ..bolfi import Bolfi
from ..gp.optimise import minimise_in_box
from ..prior import Prior
from ..result import Fit
from ..sampling.importance import explore, weighted_quantiles
from ..sampling.target import Target
from ..surrogates.measurement_noise import Layout, Nodes, Reduced
from ..surrogates.output_vectors import Output
from ..surrogates.signal import SignalFamily, SignalSurrogate
from ..surrogates.signal_likelihood import SignalLikelihood, eliminate, scores
from .measurement_noise import Noise, samples
from .model_errors import split_noise
from .run_noise import own_errors, resized, smooth_covariance
from .runs import LATER_HALF_WIDTH, PriorBox, Runs

COMPONENTS = 10
SIZES = 12  # of the model error, that the likelihood is averaged over
LEAST_SCALE = 1e-9  # of a variance whose model error is smaller than expected
PRIOR_PRECISION = 12.0  # of a uniform quantile
TINY_PRECISION = 1e-9
SLOPE_STEP = 0.02  # of prior quantiles, for slopes
PRIOR_END = 1e-4  # quantile of a prior from which a parameter is at its end
INDEPENDENT_SLOPE = 1e-8  # relative size below which a slope adds nothing to those before


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A fitted model; arrays over the m values of what was observed.

    Attributes:
        names: Effects that act.
        fit: The engine's; its likelihood takes all noise from here, but for the model error's size,
            over which it is averaged, and holds near `u`.
        within: Where it was simulated.
        u: Where in there the expected output is nearest to what was observed, prior quantiles [d].
        difference: Observed less expected there [m].
        latent: Covariance of what the emulator does not know [m, m].
        own: Covariance of the simulator's own noise [m, m].
        noise: Covariance of the noise between the simulator and the data [m, m].
        error_sizes: Sizes that the model error in that noise may have.
    """

    names: tuple[str, ...]
    fit: Fit
    within: PriorBox
    u: np.ndarray
    difference: np.ndarray
    latent: np.ndarray
    own: np.ndarray
    noise: np.ndarray
    error_sizes: "ErrorSizes"

    @property
    def surrogate(self) -> SignalSurrogate:
        assert isinstance(self.fit.learned, SignalSurrogate)
        return self.fit.learned

    @property
    def best(self) -> dict[str, float]:
        """Parameters at which the expected output is nearest to what was observed."""
        return {name: float(v) for name, v in self.fit.prior.from_unit(self.u).items()}

    @property
    def layout(self) -> Layout:
        return self.surrogate.output.layout

    @property
    def spread(self) -> np.ndarray:
        """Covariance of what the simulator and its emulator add [m, m]."""
        return self.latent + self.own

    @cached_property
    @in_float64
    def factor(self) -> np.ndarray:
        """Lower Cholesky factor of the difference's covariance [m, m]."""
        return np.linalg.cholesky(self.spread + self.noise)

    @property
    def doubt(self) -> float:
        """Emulator's variance over all variance, summed over the data."""
        return float(np.trace(self.whiten(self.whiten(self.latent))))

    @cached_property
    @in_float64
    def slopes(self) -> np.ndarray:
        """Whitened derivatives of the expected values by the prior quantiles [m, d]."""
        d = len(self.u)
        above = np.minimum(self.u + SLOPE_STEP * np.eye(d), 1.0)
        below = np.maximum(self.u - SLOPE_STEP * np.eye(d), 0.0)
        rise = self.expected(above) - self.expected(below)
        return self.whiten(rise / np.diag(above - below)[:, None])

    @cached_property
    @in_float64
    def tangents(self) -> np.ndarray:
        """Orthonormal directions of whitened values that the parameters absorb [m, <= d].

        A parameter at an end of its prior would have to leave it to absorb more.
        """
        free = (self.u > PRIOR_END) & (self.u < 1.0 - PRIOR_END)
        left, size, _ = np.linalg.svd(self.slopes[:, free], full_matrices=False)
        return left[:, size > INDEPENDENT_SLOPE * size.max(initial=1.0)]

    @cached_property
    @in_float64
    def posterior_covariance(self) -> np.ndarray:
        """Covariance of the parameters in prior quantiles, by Laplace's approximation [d, d]."""
        information = self.slopes.T @ self.slopes + PRIOR_PRECISION * np.eye(len(self.u))
        return np.linalg.inv(information)

    @property
    def sd(self) -> np.ndarray:
        """Sds of the parameters in prior quantiles [d]."""
        return np.sqrt(np.diag(self.posterior_covariance))

    @in_float64
    def whiten(self, rows: np.ndarray) -> np.ndarray:
        """Values [n, m] -> columns [m, n] of unit covariance."""
        return solve_triangular(self.factor, np.atleast_2d(rows).T, lower=True)

    def project(self, white: np.ndarray) -> np.ndarray:
        """Whitened columns [m, n] less what the parameters absorb of them."""
        return white - self.tangents @ (self.tangents.T @ white)

    def visible(self, rows: np.ndarray) -> np.ndarray:
        """Values [n, m] -> whitened columns [m, n] of what the parameters do not absorb."""
        return self.project(self.whiten(rows))

    @in_float64
    def expected(self, u: np.ndarray) -> np.ndarray:
        """Expected values [n, m] at prior quantiles u [n, d]."""
        return self.surrogate.emulator.predict(np.atleast_2d(u))[0]

    def misfit(self, metric: "Hypothesis") -> float:
        """Squared length of the difference under another hypothesis's covariance."""
        return float(np.sum(metric.whiten(self.difference) ** 2))

    @in_float64
    def gain(self, base: "Hypothesis") -> float:
        """Log likelihood beyond a base model's; what simulator and emulator add counts alike."""
        own, of_base = (
            float(one.error_sizes.log_densities(one.difference[None], base.spread + one.noise)[0])
            for one in (self, base)
        )
        return own - of_base

    @cached_property
    @in_float64
    def coefficient_sds(self) -> np.ndarray:
        """Sds of the coefficients in prior quantiles by the likelihood alone, each given those
        before it [k]."""
        first = len(self.u) - len(self.names)
        alone = np.diag(np.linalg.cholesky(self.posterior_covariance[first:, first:]))
        return np.maximum(alone**-2.0 - PRIOR_PRECISION, TINY_PRECISION) ** -0.5

    @property
    def occam(self) -> float:
        """Log of the share of the coefficients' prior that explains the data as well as the best.

        By Laplace's approximation within the prior. What the other parameters cost is nearly the
        same without them.
        """
        sd, u = self.coefficient_sds, self.u[len(self.u) - len(self.names) :]
        inside = ndtr((1.0 - u) / sd) - ndtr(-u / sd)
        return float(np.sum(np.log(np.sqrt(2.0 * np.pi) * sd * inside)))


@in_float64
def hypothesise(
    names: tuple[str, ...],
    prior: Prior,
    runs: Runs,
    observed: np.ndarray,
    noise: Noise,
    within: PriorBox,
) -> Hypothesis:
    """Fit the model in which the named effects act to what was observed.

    Args:
        prior: Of the base parameters and the named coefficients.
        runs: Simulations; those in which another effect acts are left out.
        observed: [*signal_shape], NaN where missing.
        noise: Between the simulator and the data.
        within: Where the effects were simulated. Elsewhere the emulator only guesses, and of all
            guesses some are near to whatever was observed.
    """
    used = runs.of(names)
    # every component: a small effect may show in one that few runs hardly predict
    covariance = noise.covariance(samples(observed))
    fixed = {"misfit": 0, "components": COMPONENTS, "predicted": None, "varying_noise": False}
    family = SignalFamily(noise=covariance, **fixed)
    engine = Bolfi(prior, observed, surrogate=family)
    theta = {name: used.theta[name] for name in prior.names}
    engine.tell(theta, used.signals, used.seeds)
    fit = engine.fit(warn=False)  # that a model cannot reach the data is what is looked for
    surrogate = fit.learned
    assert isinstance(surrogate, SignalSurrogate) and surrogate.known is not None
    emulator, known = surrogate.emulator, surrogate.known.covariance
    errors = own_errors(emulator)
    near, _ = _nearest(surrogate, errors, within)
    # now that it is known where it fits best, so is how noisy the simulator is there
    errors = resized(errors, prior.to_unit(theta)[fit.training_mask], near)
    u, own = _nearest(surrogate, errors, within)
    sizes = error_sizes(noise, samples(observed))
    sizes = sizes._replace(part=surrogate.output.average_covariance(sizes.part))
    found = Hypothesis(
        names=names,
        fit=fit,
        within=within,
        u=u,
        difference=surrogate.observed - emulator.predict(u[None])[0][0],
        latent=emulator.latent_covariance(u),
        own=own,
        noise=known,
        error_sizes=sizes,
    )
    near_best = PriorBox.around(u, found.sd, LATER_HALF_WIDTH, most=np.inf)
    reduced = _reduced(surrogate, sizes.covariances(own + known))
    learned = replace(
        surrogate,
        reduced=reduced._replace(log_weight=reduced.log_weight + sizes.log_weight),
        nodes=Nodes(*(np.zeros(len(sizes.sizes)) for part in Nodes._fields)),
        log_prior=sizes.log_weight,
        box=tuple(near_best.intersection(within)),
    )
    return replace(found, fit=replace(fit, learned=learned))


def _nearest(
    surrogate: SignalSurrogate, errors: np.ndarray, within: PriorBox
) -> tuple[np.ndarray, np.ndarray]:
    """Prior quantiles [d] in a box at which the expected output is nearest to that observed, and
    the covariance [m, m] of the simulator's own noise, of which there are draws [n, m]."""
    assert surrogate.known is not None
    own = smooth_covariance(errors, surrogate.output.layout, surrogate.output.long)
    reduced = _reduced(surrogate, [own + surrogate.known.covariance])
    likelihood = replace(surrogate, reduced=reduced).log_likelihood
    return minimise_in_box(partial(_squared_distance, likelihood), len(within.low), *within), own


class ErrorSizes(NamedTuple):
    """Sizes that the model error may have.

    Few clean data tell how large it is; the residual of these data tells more.

    Attributes:
        part: Covariance of the model error at size 1 [m, m], a part of the noise's; zero where
            there is no model error.
        sizes: Variances of the model error in units of `part` [s].
        log_weight: Log prior weights of the sizes [s].
    """

    part: np.ndarray
    sizes: np.ndarray
    log_weight: np.ndarray

    def covariances(self, mean: np.ndarray) -> list[np.ndarray]:
        """Covariances of the noise, [m, m] for each size; that of size 1 is `mean` [m, m]."""
        return [mean + (size - 1.0) * self.part for size in self.sizes]

    @in_float64
    def log_densities(self, rows: np.ndarray, mean: np.ndarray) -> np.ndarray:
        """Log densities [n], but for (2 pi)^(m/2), of residuals [n, m], averaged over the sizes.

        `mean` is the covariance of the noise at size 1 [m, m].
        """
        # the covariances of all sizes have the same generalised eigenvectors
        share, vectors = eigh(self.part, mean)
        scale = np.maximum(1.0 + np.outer(self.sizes - 1.0, share), LEAST_SCALE)
        squares = (rows @ vectors) ** 2
        each = -0.5 * (squares @ (1.0 / scale).T + np.log(scale).sum(1))
        each += np.linalg.slogdet(vectors)[1]  # less half the log determinant of `mean`
        return np.asarray(logsumexp(each + self.log_weight, axis=1))


def error_sizes(noise: Noise, at: Layout) -> ErrorSizes:
    """Sizes of the model error in the noise of m samples."""
    error = split_noise(noise)[1]
    if error is None:
        return ErrorSizes(np.zeros((len(at.sample),) * 2), np.ones(1), np.zeros(1))
    return ErrorSizes(error.covariance(at), *error.sizes(SIZES))


def _reduced(surrogate: SignalSurrogate, covariances: Sequence[np.ndarray]) -> Reduced:
    """Generalised least-squares estimates of the scores, one for each noise covariance [m, m]."""
    basis, g = surrogate.emulator.basis, len(covariances)
    used = basis.used
    estimate, error = np.zeros((g, used)), np.zeros((g, used, used))
    log_weight, unexplained = np.zeros(g), np.zeros(g)
    vectors, target = basis.vectors[:, :used], basis.standardise(surrogate.observed)
    for i, covariance in enumerate(covariances):
        factor = np.linalg.cholesky(covariance / np.outer(basis.scale, basis.scale))
        white = solve_triangular(factor, np.column_stack([vectors, target]), lower=True)
        error[i] = np.linalg.inv(white[:, :used].T @ white[:, :used])
        estimate[i] = error[i] @ (white[:, :used].T @ white[:, used])
        left = white[:, used] - white[:, :used] @ estimate[i]
        # the estimate's own normalisation belongs to N(estimate; scores, error)
        unexplained[i] = left @ left
        log_weight[i] = 0.5 * (np.linalg.slogdet(error[i])[1] - unexplained[i])
        log_weight[i] -= np.log(np.diag(factor)).sum()
    return Reduced(estimate, error, log_weight - log_weight.max(), unexplained, np.ones(g))


def _squared_distance(state: SignalLikelihood, u: np.ndarray) -> np.ndarray:
    """At u [n, d]: half the squared distance of expected from observed scores, by the noise alone.

    Not the likelihood, in which the emulator's variance counts as noise: where a model cannot
    reach the data, it is greatest where the emulator knows least.
    """
    return 0.5 * eliminate(state.covariance[0], state.estimate[0] - scores(state, u)[0])[1]


def values_of(output: Output, drawn: np.ndarray) -> np.ndarray:
    """Draws [n, samples] in the flattened order as values [n, m]."""
    return output.average(drawn[:, output.rank].T).T


class Interval(NamedTuple):
    """Mean and 90 % interval of one parameter."""

    mean: float
    q05: float
    q95: float


class Weighted(NamedTuple):
    """Points of a posterior in natural units, name -> [n], and their weights [n]."""

    theta: dict[str, np.ndarray]
    weights: np.ndarray

    def draw(self, seed: int, count: int) -> dict[str, np.ndarray]:
        """A systematic sample along the first parameter, name -> [count]."""
        order = np.argsort(next(iter(self.theta.values())))
        reached = np.cumsum(self.weights[order])
        start = np.random.default_rng(seed).random()
        at = np.searchsorted(reached, (start + np.arange(count)) / count * reached[-1])
        chosen = order[np.minimum(at, len(order) - 1)]
        return {name: values[chosen] for name, values in self.theta.items()}

    def interval(self, name: str) -> Interval:
        """Mean and 90 % interval of a parameter."""
        values = self.theta[name]
        low, high = weighted_quantiles(values, self.weights, (0.05, 0.95))
        mean = np.average(values, weights=self.weights)
        return Interval(float(mean), float(low), float(high))


@in_float64
def weighted_posterior(hypothesis: Hypothesis, seed: int = 0) -> Weighted:
    """Adaptive importance sampling of a hypothesis's posterior, see `importance.explore`."""
    surrogate, prior = hypothesis.surrogate, hypothesis.fit.prior
    target = Target(surrogate.log_likelihood, len(prior))
    found = explore(np.random.default_rng(seed), target)
    used = np.isfinite(found.log_weights)
    weights = np.exp(found.log_weights[used] - found.log_weights[used].max())
    theta = prior.from_unit(ndtr(found.x[used]))
    return Weighted(theta, weights / weights.sum())
