"""The surrogate that emulates the output itself, and compares it with what was observed."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .._float64 import in_float64
from ..gp.optimise import minimise_in_box
from ..gp.process import GP, believe
from ..sobol import sobol
from ..types import LogLikelihood, LogSecondMoment
from .emulator import (
    Emulator,
    loo_errors,
    noise_share,
    predict,
    predictive_draws,
)
from .given_noise import GivenNoise
from .held_back import HeldBack, held_back
from .measurement_noise import (
    NO_MEASUREMENT_NOISE,
    Nodes,
    Reduced,
    candidates,
    correlated,
    reduce,
    residual_size,
)
from .output_vectors import Output
from .signal_likelihood import (
    SignalState,
    log_likelihood,
    log_second_moment,
    node_log_densities,
)
from .warnings import (
    EQUAL,
    OUTSIDE,
    UNPREDICTED,
    complaints,
    held_back_warnings,
    noise_warnings,
)

KEPT_NODES = 12  # nodes of unknown measurement noise that enter the likelihood
SCREENED_POINTS = 128


@dataclass(frozen=True, eq=False)
class SignalSurrogate:
    """An emulator, and what the observed output says of its scores.

    Attributes:
        emulator: Of the outputs.
        output: How outputs become values.
        observed: The observed values [m].
        known: Measurement noise that the user gave.
        nodes: Sizes and correlations of the unknown measurement noise, KEPT_NODES of them. Of
            size 0 where there is none or it is known: one, or as many as covariances that the
            noise may have.
        reduced: The observed scores at each, with the scores' run-to-run noise.
        box: Ends [d], [d] in prior quantiles of the box outside of which the likelihood vanishes;
            None is everywhere. Where hardly anything was simulated, the emulator knows least, and
            what it does not know counts as noise that explains anything.
    """

    emulator: Emulator
    output: Output
    observed: np.ndarray
    known: GivenNoise | None
    nodes: Nodes
    reduced: Reduced
    box: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def gp(self) -> GP:
        return self.emulator.gp

    @cached_property
    @in_float64
    def state(self) -> SignalState:
        return state_of(self.emulator, self.reduced, self.box)

    @cached_property
    def held_back(self) -> HeldBack:
        """Errors of the last simulations."""
        return held_back(self.emulator, self.output.scale)

    @property
    def log_likelihood(self) -> LogLikelihood:
        return log_likelihood

    @property
    def log_second_moment(self) -> LogSecondMoment:
        return log_second_moment

    @in_float64
    def minimum(self) -> np.ndarray:
        """Maximiser of the likelihood over the box, u [d]."""
        state = self.state
        return minimise_in_box(lambda u: -log_likelihood(state, u), len(state.low), *self.box or ())

    @in_float64
    def believe(self, u: np.ndarray) -> "SignalSurrogate":
        """Condition on the predicted means at u [n, d], for points still being simulated."""
        if len(u) == 0:
            return self
        return replace(self, emulator=self.emulator._replace(gp=believe(self.gp, u)))

    @property
    @in_float64
    def node_weights(self) -> np.ndarray:
        """Posterior weights of the nodes, given the best parameters."""
        log_weights = node_log_densities(self.state, self.minimum()[None])[0]
        weights = np.exp(log_weights - log_weights.max())
        return weights / weights.sum()

    @in_float64
    def constants(self) -> dict[str, np.ndarray]:
        """What a reader of the posterior must know of the likelihood."""
        weights = self.node_weights
        sd = weights @ self.nodes.sigma * self.emulator.basis.scale[0]
        if self.known is not None:
            sd = np.sqrt(self.known.variance[0])
        return {
            "components": np.asarray(self.emulator.basis.used),
            "explained_variance": np.asarray(self.emulator.basis.explained),
            "run_to_run_noise_share": np.asarray(noise_share(self.emulator)),
            # of the output's first value; a channel's noise is in proportion to its scale
            "measurement_noise_sd": np.asarray(sd),
            "measurement_noise_correlation": weights @ self.nodes.rho,
        }

    @in_float64
    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new simulated output's values at u [n, d]: [n, m], [n, m].

        The sd holds the emulator's and the run-to-run variance, not measurement noise.
        """
        return predict(self.emulator, u)

    @in_float64
    def checks(self) -> dict[str, np.ndarray]:
        """Studentised errors: leave-one-out ones `loo_z` [n, components in use], and `foretold_z`
        [n, components + 1], see `HeldBack`."""
        return {"loo_z": loo_errors(self.emulator), "foretold_z": self.held_back.errors}

    @in_float64
    def warnings(self) -> list[str]:
        """What the emulator's own checks complain of."""
        if self.emulator.basis.used == 0:
            return [EQUAL if self.emulator.equal else UNPREDICTED]
        said = complaints(loo_errors(self.emulator), "output")
        said += noise_warnings(noise_share(self.emulator)) + held_back_warnings(self.held_back)
        return [OUTSIDE, *said] if self._outside() else said

    def _outside(self) -> bool:
        """Whether the observed scores are twice as far out as any simulated ones, or what no
        component can make of the output exceeds what simulations differ by."""
        basis = self.emulator.basis
        used = slice(basis.used)
        reach = np.abs(self.gp.data.y[used]).max(1)
        error = np.sqrt(np.diagonal(self.reduced.covariance, axis1=1, axis2=2))[:, used]
        far = np.abs(self.reduced.estimate[:, used]) > 2.0 * reach + 3.0 * error
        size = residual_size(basis.standardise(self.observed), basis.vectors[:, used])
        return bool(far.any(1).all()) or (self.output.series and size > 1.0)

    @in_float64
    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new observation, measurement noise included, for each row of u [n, d]: [n, ...].

        Noise that is known is drawn with the covariance `known`. NaN where nothing was observed;
        averaged values are repeated over their samples.
        """
        values = predictive_draws(rng, self.emulator, u)
        weights = self.node_weights
        which = rng.choice(len(weights), len(u), p=weights)
        nodes = Nodes(*(part[which] for part in self.nodes))
        noise = correlated(rng.normal(size=values.shape), self.output.layout, nodes)
        values = values + self.emulator.basis.scale * noise
        if self.known is not None:
            values = values + self.known.draw(rng, len(values))
        return {"signal": self.output.restore(values)}


def state_of(
    emulator: Emulator, reduced: Reduced, box: tuple[np.ndarray, np.ndarray] | None = None
) -> SignalState:
    """What the likelihood depends on: of the components in use."""
    used, d = emulator.basis.used, emulator.gp.data.u.shape[1]
    return SignalState(
        emulator.gp.only(slice(used)),
        np.ones(used),
        reduced.estimate[:, :used],
        reduced.covariance[:, :used, :used],
        reduced.log_weight,
        *(box or (np.zeros(d), np.ones(d))),
    )


@in_float64
def observe(
    emulator: Emulator,
    output: Output,
    observed: np.ndarray,
    noise: GivenNoise | None,
    previous: SignalSurrogate | None = None,
) -> SignalSurrogate:
    """Compare with the observed values [m].

    The measurement noise is unknown unless given: its size and correlation are integrated out
    over nodes, under a prior even in the logarithm of the size, centred on what no
    combination of the components explains.

    Args:
        noise: The measurement noise; None to estimate it where the output is a series, and for
            none where it is not.
        previous: Its nodes are kept.
    """
    basis, remainder = emulator.basis, emulator.remainder
    target, used = basis.standardise(observed), emulator.basis.used
    vectors, factors = basis.vectors, remainder.factors
    white = np.full(len(target), remainder.white)
    if noise is not None:
        white = white + noise.white / basis.scale**2
        factors = np.column_stack([factors, noise.factors / basis.scale[:, None]])
    if previous is not None:
        nodes = previous.nodes
    elif noise is not None or not output.series or emulator.equal:
        nodes = NO_MEASUREMENT_NOISE
    else:
        nodes = candidates(residual_size(target, vectors[:, :used]))
    if emulator.equal:  # nothing to compare
        reduced = Reduced(np.zeros((1, 0)), np.zeros((1, 0, 0)), np.zeros(1))
    else:
        reduced = reduce((vectors, target, factors), white, output.layout, nodes)
    reduced = _widen(reduced, emulator)
    if len(reduced.log_weight) > KEPT_NODES:
        kept = _keep(emulator, reduced)
        reduced = Reduced(*(part[kept] for part in reduced))
        nodes = Nodes(*(part[kept] for part in nodes))
    return SignalSurrogate(emulator, output, observed, noise, nodes, reduced)


def _widen(reduced: Reduced, emulator: Emulator) -> Reduced:
    """To all components, with the scores' run-to-run noise in the covariance; the largest weight
    becomes 1."""
    used, k = emulator.basis.used, emulator.basis.vectors.shape[1]
    nodes = len(reduced.log_weight)
    estimate = np.zeros((nodes, k))
    estimate[:, :used] = reduced.estimate
    covariance = np.tile(np.eye(k), (nodes, 1, 1))
    covariance[:, :used, :used] = reduced.covariance + emulator.noise[:used, :used]
    return Reduced(estimate, covariance, reduced.log_weight - reduced.log_weight.max())


def _keep(emulator: Emulator, reduced: Reduced) -> np.ndarray:
    """The nodes of most evidence, best first, on an even screen of the prior and at the data."""
    data = emulator.gp.data.u
    points = np.concatenate([sobol(0, 0, SCREENED_POINTS, data.shape[1]), data])
    terms = node_log_densities(state_of(emulator, reduced), points)
    return np.argsort(-np.logaddexp.reduce(terms, 0))[:KEPT_NODES]
