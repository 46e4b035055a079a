"""The surrogate that emulates the output itself, and compares it with what was observed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import softmax

from .._lazy import stats
from ..arguments import (
    check_callable,
    check_flag,
    check_runs,
    checked_integer,
    checked_number,
    require,
)
from ..gp.optimise import minimise_in_box
from ..gp.process import GP, fantasize
from ..history import told_signals
from ..prior import Prior, check_support
from ..simulations.failures import Failure, not_finite
from ..sobol import sobol
from ..types import Discrepancy, Theta
from . import warnings
from .base import Family, Measured, TrainingData
from .emulator import (
    PREDICTED_SHARE,
    CheapRuns,
    Emulator,
    EmulatorLimits,
    emulate,
    resized,
    run_spread,
)
from .measurement_noise import (
    MIN_SIZE,
    NO_MEASUREMENT_NOISE,
    Nodes,
    Reduced,
    Remainder,
    Weighted,
    correlated,
    misfit_beside,
    reduce,
    residual_size,
    unknown_noise,
)
from .noise.by_mean import ByMean, OutputScale, Plain, SdOfMean, law_of
from .noise.given import Covariance, GivenNoise, check_noise, given_noise
from .noise.stretched import stretched
from .output_vectors import Output, Summary, describe, infinities, summarise
from .pointwise import covariances, log_conditionals, weighed
from .processes import OfProcesses, learn_success
from .signal_likelihood import SignalLikelihood, likelihood_of, node_log_densities
from .squared_difference import MIN_FREEDOM, evaluate, failed_on, sum_of_squares

KEPT_NODES = 12  # nodes of unknown measurement noise that enter the likelihood
SCREENED_POINTS = 128
MISFIT_POINTS = 1024  # among which the smallest misfit is looked for
NEEDED = 0.95  # posterior probability of a misfit from which it is said
LEAST_SEEN = 0.01  # of the outputs' sd, from which a misfit is worth a word
MAX_COMPONENTS = 8
MIN_CHEAP = 3  # successful runs of a cheap simulator
SLOW = 0.9  # correlation of neighbouring samples from which noise looks like a signal


@dataclass(frozen=True, eq=False)
class SignalSurrogate(OfProcesses):
    """An emulator, and what the observed output says of its scores.

    Attributes:
        emulator: Of the outputs.
        output: How outputs become values.
        observed: The observed values on the emulator's scale [m].
        known: Measurement noise that the user gave, on that scale.
        nodes: Sizes and correlations of the unknown measurement noise, or of a misfit beside noise
            that is given; KEPT_NODES of them. Size 0 is no misfit.
        log_prior: Log weights of the nodes before anything is compared [g].
        reduced: The observed scores at each, with the scores' run-to-run noise.
        box: Ends [d], [d] in prior quantiles of the box outside of which the likelihood vanishes;
            None is everywhere. Where hardly anything was simulated, the emulator knows least, and
            what it does not know counts as noise that explains anything.
        success: Where runs succeed, see `processes.learn_success`.
        scale: Leads from the output's values to the emulator's features.
        lost: What the likelihood lacks to be the log density of the standardised values.
    """

    emulator: Emulator
    output: Output
    observed: np.ndarray
    known: GivenNoise | None
    nodes: Nodes
    log_prior: np.ndarray
    reduced: Reduced
    box: tuple[np.ndarray, np.ndarray] | None = None
    success: GP | None = None
    scale: OutputScale = Plain(np.zeros(0), None)
    lost: float = 0.0

    @property
    def gp(self) -> GP:  # pyright: ignore  nobody sets it
        return self.emulator.gp

    @cached_property
    def log_likelihood(self) -> SignalLikelihood:  # pyright: ignore  nobody sets it
        found = likelihood_of(self.emulator, self.reduced, self.box)
        return found._replace(success=self.success)

    @property
    def stated(self) -> "SignalSurrogate":
        """The surrogate without a misfit beside the noise that was given."""
        if self.known is None or not self.nodes.sigma.any():
            return self
        found = observe(self.emulator, self.output, self.observed, self.known, 0.0)
        return replace(found, box=self.box, success=self.success, scale=self.scale)

    @property
    def sure(self) -> SignalLikelihood:
        """The log likelihood, were the simulator the emulator's mean. What looks like run-to-run
        noise, but repeated runs do not bear out, is doubt, too."""
        found, share = self, max(self.emulator.borne_out, MIN_SIZE**2)
        if share < 1.0:
            white, factors = self.emulator.remainder.white, self.emulator.remainder.factors
            remainder = Remainder(np.sqrt(share) * factors, share * white)
            noise = share * self.emulator.noise
            emulator = self.emulator._replace(noise=noise, remainder=remainder)
            found = observe(emulator, self.output, self.observed, self.known, 0.0, self)
            found = replace(found, box=self.box, success=self.success)
        return found.log_likelihood._replace(doubt=np.zeros(()))

    def best(self) -> np.ndarray:
        """Maximiser of the likelihood over the box, u [d]."""
        likelihood = self.log_likelihood
        return minimise_in_box(lambda u: -likelihood(u), self.u.shape[1], *self.box or ())

    def fantasize(self, u: np.ndarray) -> "SignalSurrogate":
        """Condition on the predicted means at u [n, d], for points still being simulated."""
        if len(u) == 0:
            return self
        fantasized = fantasize(self.gp, u, run_spread(self.emulator.size, u))
        return replace(self, emulator=self.emulator._replace(gp=fantasized))

    @cached_property
    def node_weights(self) -> np.ndarray:
        """Posterior weights of the nodes, given the best parameters."""
        return softmax(node_log_densities(self.log_likelihood, self.best()[None])[0])

    @property
    def best_features(self) -> np.ndarray:
        """Predicted features at the best parameters, on the emulator's scale [m]."""
        return self.emulator.predict(self.best()[None])[0][0]

    @property
    def misfit_probability(self) -> float:
        """Posterior probability of a misfit beside noise that is given."""
        return float(self.node_weights[self.nodes.sigma > 0.0].sum())

    def constants(self) -> dict[str, np.ndarray]:
        """Components, variances and noise."""
        weights = self.node_weights
        given, misfit = self._noise_sds
        return {
            "components": np.asarray(self.emulator.basis.used),
            "explained_variance": np.asarray(self.emulator.basis.explained),
            "run_to_run_noise_share": np.asarray(self.emulator.noise_share),
            # of the output's first value; a channel's noise is in proportion to its scale
            "measurement_noise_sd": np.hypot(misfit, given),
            "measurement_noise_correlation": weights @ self.nodes.rho,
        }

    @property
    def _noise_sds(self) -> tuple[np.ndarray, np.ndarray]:
        """Sds in the output's first value of noise that is given, and of what is estimated: noise
        where none is given, else a misfit where there is one."""
        needed = self.known is None or self._missed()
        scale, best = self.emulator.basis.scale, self.best_features[None]
        misfit = needed * np.sqrt(self.node_weights @ self.nodes.sigma**2) * scale
        given = self.scale.sds(self.scale.back(best))[0, 0]
        return given, self.scale.in_units(best, misfit[None])[0, 0]

    def described(self) -> list[str]:
        """The noise, how it was found, and what of a summary is not compared."""
        given, found = self._noise_sds
        missing = int(np.prod(self.output.shape)) - len(self.output.present)
        said = missing and self.output.summary is not None
        lost = [f"{missing} values of the summary of observed missing"] if said else []
        if self.known is None:
            return [f"measurement noise of sd {found:.3g} in the first value, estimated", *lost]
        misfit = f", and a misfit of sd {found:.3g}" if self._missed() else ""
        return [f"measurement noise of sd {given:.3g} in the first value, given{misfit}", *lost]

    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new simulated output's values at u [n, d]: [n, m], [n, m].

        The sd holds the emulator's and the run-to-run variance, not measurement noise.
        """
        mean, sd = self.emulator.predict(u)
        return self.scale.back(mean), self.scale.in_units(mean, sd)

    def checks(self) -> dict[str, np.ndarray]:
        """Studentised leave-one-out errors `loo_z` [n, components in use]."""
        return {"loo_z": self.emulator.loo_errors()}

    @property
    def fits(self) -> bool:
        """Whether parameters and noise explain what was observed."""
        return not (self._unexplained() or self.unreached)

    def warnings(self, *, confirmed: bool = False) -> list[str]:
        """Warnings of the emulator's own checks, unless it is confirmed, of noise and misfit, and
        of the observed values."""
        repeats, sized = self.emulator.repeats, self.emulator.size is not None
        if self.emulator.basis.used == 0 and not sized:
            fast = len(repeats) and not repeats.any()
            unknown = warnings.TOO_FAST if fast else warnings.UNPREDICTED
            said = [warnings.EQUAL if self.emulator.equal else unknown]
            return [*said, *self._unexplained(), *self._of_data()]
        said = [] if confirmed else warnings.complaints(self.emulator.loo_errors(), "output")
        said += warnings.noise_warnings(self.emulator.noise_share, repeats, sized)
        said += self._unexplained() or [warnings.GENEROUS] * self._generous()
        if self.known is None and len(self.observed) - self.u.shape[1] < MIN_FREEDOM:
            said.append(warnings.FEW_NUMBERS)
        return said + self._of_data()

    def _unexplained(self) -> list[str]:
        """Why parameters and noise do not explain what was observed, if they do not."""
        if self._outside():
            return [warnings.OUTSIDE]
        if self._missed():
            return [warnings.MISFIT]
        return [warnings.SMOOTH] if self._smooth() else []

    def _of_data(self) -> list[str]:
        """Warn of positive values that span decades, and of a number that no run reaches."""
        ranges = warnings.range_warnings(self.scale.observed) if self.known is None else []
        return ranges + self.unreached

    @property
    def unreached(self) -> list[str]:
        """That an emulated number lies beyond all simulated ones, if it does."""
        values = self.scale.observed
        noise = float(self.scale.sds(values[None])[0, 0])
        return warnings.unreached_warnings(values, self.scale.back(self.emulator.outputs), noise)

    def _missed(self) -> bool:
        """Whether the given noise does not explain what was observed."""
        return self.known is not None and self.misfit_probability > NEEDED

    def _generous(self) -> bool:
        """Whether a simulation misses independent data by less than the given noise allows."""
        freedom = len(self.observed) - self.u.shape[1]
        known, even = self.known, isinstance(self.scale, Plain) and freedom >= MIN_FREEDOM
        if not even or known is None or known.factors.size or not known.white.all():
            return False
        least = np.min((self.emulator.outputs - self.observed) ** 2 @ (1.0 / known.white))
        return bool(least < stats.chi2.ppf(warnings.FALSE_ALARMS, freedom))

    def _smooth(self) -> bool:
        """Whether the noise that was found varies as slowly as a signal, and is most of what no
        component can make of the data."""
        if self.known is not None or not self.output.long:
            return False
        weights, (sigma, rho) = self.node_weights, self.nodes
        slow = float(weights @ (sigma**2 * (rho > SLOW)))
        residual = _residual(self.emulator, self.observed)
        most = 0.5 * max(residual**2, float(weights @ sigma**2))
        return slow > max(most, LEAST_SEEN**2)

    def _outside(self) -> bool:
        """Whether the observed scores are twice as far out as any simulated ones, or what no
        component can make of the output exceeds what simulations differ by."""
        reach = np.abs(self.emulator.scores.data.y).max(1)
        error = np.sqrt(np.diagonal(self.reduced.covariance, axis1=1, axis2=2))
        far = np.abs(self.reduced.estimate) > 2.0 * reach + 3.0 * error
        varied = np.sum(self.emulator.basis.vectors**2) + self.emulator.remainder.total
        differ = np.sqrt(varied / len(self.observed))  # what simulations differ by
        residual = _residual(self.emulator, self.observed)
        far_off = self.output.long and residual > max(1.0, differ)
        if far.any(1).all() or not far_off:
            return bool(far.any(1).all())
        # noise as it is given, or one that varies fast, may explain the residual
        given, slow = self.known is not None, self.nodes.rho > SLOW
        return self._missed() if given else bool(self.node_weights @ slow >= 0.5)

    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new observation, measurement noise included, for each row of u [n, d]: [n, ...].

        Noise that is known is drawn with the covariance `known`. NaN where nothing was observed;
        averaged values are repeated over their samples.
        """
        values = self.emulator.draw(rng, u)
        weights = self.node_weights
        which = rng.choice(len(weights), len(u), p=weights)
        nodes = Nodes(*(part[which] for part in self.nodes))
        noise = correlated(rng.normal(size=values.shape), self.output.layout, nodes)
        values = self.scale.back(values + self.emulator.basis.scale * noise)
        return self.placed(self.scale.observe(rng, values))

    def placed(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Values [n, m] at their places in the "signal", NaN where nothing was observed; and as
        "values", where they are those of a summary, or samples are missing or averaged."""
        whole = {} if self.output.summary else {"signal": self.output.restore(values)}
        return whole if self.output.complete else {**whole, "values": values}

    @property
    def compared(self) -> dict[str, np.ndarray]:
        return {} if self.output.complete else {"values": self.scale.observed}

    @cached_property
    def _log_slopes(self) -> np.ndarray:
        """Log of what takes densities of the standardised values to those of the values [m]."""
        levels = self.scale.log_levels(self.best_features, (self.observed, self.known))
        return levels - np.log(self.emulator.basis.scale)

    @property
    def log_constant(self) -> float:
        return np.nan if self.emulator.equal else self.lost + float(self._log_slopes.sum())

    @property
    def log_variance(self) -> float:
        """Of what components leave, as far as no repeated run bears out that it is noise: to first
        order in that, at the best parameters."""
        emulator, share = self.emulator, 1.0 - self.emulator.borne_out
        if emulator.equal or not share:
            return 0.0
        basis, g = emulator.basis, int(self.node_weights.argmax())
        node = Nodes(*(part[g : g + 1] for part in self.nodes))
        (covariance,) = covariances(*_noise(emulator, self.known), self.output.layout, node)
        missed = (self.observed - self.best_features) / basis.scale
        slope = np.linalg.solve(covariance, missed)
        of_scores = slope @ basis.vectors
        left = np.sum((slope @ emulator.remainder.factors) ** 2)
        left = left + emulator.remainder.white * slope @ slope
        return float(share * (left + of_scores @ emulator.noise @ of_scores))

    def pointwise(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """See `pointwise.log_conditionals`."""
        terms = np.zeros((len(u), len(self.observed)))
        if not self.emulator.equal:
            basis, layout = self.emulator.basis, self.output.layout
            vectors, target = basis.vectors[:, : basis.used], basis.standardise(self.observed)
            every = covariances(*_noise(self.emulator, self.known), layout, self.nodes)
            nodes = [weighed(one, vectors, target) for one in every]
            noise = self.emulator.noise[: basis.used, : basis.used]
            terms = log_conditionals(self.log_likelihood, nodes, noise, u) + self._log_slopes
        complete = self.output.complete
        return {"signal": self.output.restore(terms)} if complete else {"values": terms}


def observe(
    emulator: Emulator,
    output: Output,
    observed: np.ndarray,
    given: GivenNoise | None,
    misfit: float,
    previous: SignalSurrogate | None = None,
) -> SignalSurrogate:
    """Compare with the observed values [m].

    Noise that is not given, and a misfit beside noise that is, have an unknown size and
    correlation, which are integrated out over nodes. Without them a place where the emulator knows
    nothing would explain what no run explains.

    Args:
        given: The measurement noise; None where it is unknown.
        misfit: Prior probability that the data are missed by more than it explains; 0 for none.
        previous: Its nodes are kept.
    """
    basis, remainder = emulator.basis, emulator.remainder
    target, vectors = basis.standardise(observed), basis.vectors
    factors, white = _noise(emulator, given)
    kept = None if previous is None else (previous.nodes, previous.log_prior)
    nodes, log_prior = kept or _nodes(emulator, output, observed, given, misfit)
    reduced = reduce((vectors, target, factors), white, output.layout, nodes)
    own, used = emulator.noise_variance, basis.used
    other = np.sum(white - remainder.white) + np.sum(factors[:, remainder.factors.shape[1] :] ** 2)
    other = other + len(target) * nodes.sigma**2
    log_weight = reduced.log_weight + log_prior
    gone = 0.5 * (len(target) - used) * np.log(2.0 * np.pi)
    lost = float(log_weight.max() - np.logaddexp.reduce(log_prior) - gone)
    reduced = reduced._replace(
        covariance=reduced.covariance + emulator.noise[:used, :used],
        log_weight=log_weight - log_weight.max(),
        share=own / np.maximum(own + other, np.finfo(float).tiny),
    )
    if len(log_prior) > KEPT_NODES:
        kept = _keep(emulator, reduced, nodes)
        reduced = Reduced(*(part[kept] for part in reduced))
        nodes, log_prior = Nodes(*(part[kept] for part in nodes)), log_prior[kept]
    found = SignalSurrogate(emulator, output, observed, given, nodes, log_prior, reduced)
    return replace(found, lost=lost)


def _noise(emulator: Emulator, given: GivenNoise | None) -> tuple[np.ndarray, np.ndarray]:
    """Factors [m, q] and white part [m] of what is known of the noise, standardised."""
    remainder, scale = emulator.remainder, emulator.basis.scale
    factors, white = remainder.factors, np.full(len(scale), remainder.white)
    if given is None:
        return factors, white
    return np.column_stack(
        [factors, given.factors / scale[:, None]]
    ), white + given.white / scale**2


def _nodes(
    emulator: Emulator,
    output: Output,
    observed: np.ndarray,
    given: GivenNoise | None,
    misfit: float,
) -> Weighted:
    """Sizes and correlations that the unknown noise or misfit may have."""
    if given is not None and not misfit:
        return NO_MEASUREMENT_NOISE
    miss = emulator.smallest_misfit(observed, _screen(emulator, MISFIT_POINTS))
    if given is None:
        residual = _residual(emulator, observed) if output.long else None
        return unknown_noise(miss, residual, output.series)
    sd = float(np.sqrt(np.mean(given.variance / emulator.basis.scale**2)))
    return misfit_beside(sd, misfit, miss, output.series)


def _residual(emulator: Emulator, observed: np.ndarray) -> float:
    """Root mean square of what no component can make of the data [m], standardised."""
    basis = emulator.basis
    return residual_size(basis.standardise(observed), basis.vectors[:, : basis.used])


def _keep(emulator: Emulator, reduced: Reduced, nodes: Nodes) -> np.ndarray:
    """The nodes of most evidence, best first, on an even screen of the prior and at the data; none
    of these need come so near that the given noise explains the rest, so that it is kept."""
    terms = node_log_densities(likelihood_of(emulator, reduced), _screen(emulator, SCREENED_POINTS))
    evidence = np.where(nodes.sigma == 0.0, np.inf, np.logaddexp.reduce(terms, 0))
    return np.argsort(-evidence)[:KEPT_NODES]


def _screen(emulator: Emulator, count: int) -> np.ndarray:
    """`count` points that fill the prior evenly, and the runs: prior quantiles [n, d]."""
    data = emulator.gp.data.u
    return np.concatenate([sobol(0, 0, count, data.shape[1]), data])


class ObservedOutput(NamedTuple):
    """What was observed, how outputs become values, and on which scale these are emulated."""

    observed: np.ndarray  # [*signal_shape]
    output: Output
    scale: OutputScale


@dataclass(frozen=True, eq=False)
class SignalFamily(Family):
    """Principal components of the output, a Gaussian process for each score.

    Attributes:
        summary: Callable output -> vector, of the observed and of each simulated output; None
            takes the output as it is.
        noise: Measurement noise that the simulator does not make: its sd, a number or an array
            shaped like the observed (summarised) output; or sds [n], or a covariance [n, n], of
            that output's n finite values, flattened; or an object that has such a covariance, as
            `criticism.KnownNoise`, `model_error` and their `SumOfNoises`; 0 for none. "poisson"
            where counts were observed and their means are simulated; `relative(0.2)` for an sd of
            20 % of the simulated mean; or a function from simulated means to sds, value by value.
            None estimates it: as an AR(1) process where the output is a series, of at least 5
            samples without a summary.
        cheap: Runs (theta, signals) of a cheaper simulator of the same output, such as one of
            coarser cells: name -> [n] in the prior's support, and [n, *signal_shape], NaN where a
            run failed. Used as far as they predict the simulator's own runs.
        varying_noise: Whether the noise that the simulator makes itself may depend on the
            parameters and on the mean, where runs show that it does.
        misfit: Prior probability that the data are missed by more than the given noise, because
            the simulator errs or the noise is larger; its size is integrated out. 0 for never.
        components: At most.
        predicted: Share of a component's variance that the parameters must predict where its
            run is left out; what they predict less counts as run-to-run noise, unless repeated
            runs agree and it is little. None emulates every component, and takes some noise for
            structure if the simulator is noisy.
        discrepancy: As in `DiscrepancyFamily`; it only ranks simulations and finds outputs that
            blew up.
    """

    name: ClassVar[str] = "signal"
    replicates: ClassVar[bool] = True

    summary: Summary | None = None
    noise: ArrayLike | Covariance | SdOfMean | None = None
    misfit: float = 0.1
    components: int = MAX_COMPONENTS
    predicted: float | None = PREDICTED_SHARE
    discrepancy: Discrepancy | None = None
    varying_noise: bool = True
    cheap: tuple[Theta, ArrayLike] | None = None

    def __post_init__(self) -> None:
        check_callable("summary", self.summary)
        check_callable("discrepancy", self.discrepancy)
        check_flag("varying_noise", self.varying_noise)
        check_runs("cheap", self.cheap, 2)
        checked_integer("components", self.components)
        if self.noise is not None and law_of(self.noise) is None:
            check_noise(self.noise)  # pyright: ignore[reportArgumentType]  no function is left
        checked_number("misfit", self.misfit, lambda p: 0.0 <= p < 1.0, "from 0 to below 1")
        if self.predicted is not None:
            due = "None or from 0 to below 1"
            checked_number("predicted", self.predicted, lambda share: 0.0 <= share < 1.0, due)

    @property
    def any_shape(self) -> bool:
        return self.summary is not None

    def view(self, observed: np.ndarray) -> ObservedOutput:
        output = describe(observed, self.summary)
        values, law = output.values(observed), law_of(self.noise)
        if law is not None:
            return ObservedOutput(observed, output, ByMean(law, values, output.counts))
        given = None if self.noise is None else given_noise(self.noise, output)  # pyright: ignore[reportArgumentType]  no function is left
        return ObservedOutput(observed, output, Plain(values, given))

    def check_prior(self, observed: ObservedOutput, prior: Prior) -> None:
        if self.cheap is None:
            return
        check_support(prior, prior.to_dict(prior.to_array(self.cheap[0])))
        count = len(self._cheap_runs(self.cheap, observed, prior).u)
        due = f"hold {MIN_CHEAP} successful runs"
        require(count >= MIN_CHEAP, "cheap", due, count, cure="simulate more")

    def _cheap_runs(
        self, cheap: tuple[Theta, ArrayLike], observed: ObservedOutput, prior: Prior
    ) -> CheapRuns:
        theta, signals = cheap
        u = np.atleast_2d(prior.to_unit(theta))
        shape = None if self.any_shape else observed.observed.shape
        outputs = self.measure(observed, told_signals(signals, len(u), shape)[0]).features
        good = np.isfinite(outputs).all(1)
        return CheapRuns(u[good], outputs[good])

    def _cheap_features(self, data: TrainingData, scale: OutputScale) -> CheapRuns | None:
        """Cheap runs on the emulator's scale, where they have a value on it."""
        if self.cheap is None:
            return None
        runs = self._cheap_runs(self.cheap, data.observed, data.prior)
        with np.errstate(all="ignore"):
            features = scale.of(runs.outputs)
        finite = np.isfinite(features).all(1)
        return CheapRuns(runs.u[finite], features[finite]) if finite.any() else None

    def measure(self, observed: ObservedOutput, signals: Sequence[np.ndarray | None]) -> Measured:
        """Features are the output's values."""
        array, output, scale = observed
        named = "summary" if self.discrepancy is None else "discrepancy"
        distance = self.discrepancy or self._of_summaries
        discrepancy, errors = evaluate(distance, array, signals, named)
        features = np.full((len(signals), len(scale.observed)), np.nan)
        for i, signal in enumerate(signals):
            if signal is None or not np.isfinite(discrepancy[i]):
                errors[i] = errors[i] or self._infinite_summary(signal)
                continue
            asked = "summary"
            try:
                features[i] = output.values(signal)
                asked = "noise"  # the user's function of the mean
                scale.check(features[i])
            except (Exception, SystemExit) as error:  # whatever the user's code raises
                errors[i], features[i] = failed_on(asked, signal, array, error), np.nan
        failed = ~np.isfinite(features).all(1)
        return Measured(features, np.where(failed, np.nan, discrepancy), errors)

    def _of_summaries(self, observed: np.ndarray, simulated: np.ndarray) -> float:
        return sum_of_squares(*(summarise(self.summary, one) for one in (observed, simulated)))

    def _infinite_summary(self, signal: np.ndarray | None) -> Failure | None:
        """The failure of a run whose signal is finite and its summary is not."""
        compared = self.summary is not None and self.discrepancy is None
        if not compared or signal is None or not np.isfinite(signal).all():
            return None
        values = summarise(self.summary, signal)
        finite = bool(np.isfinite(values).all())
        return None if finite else not_finite(f"summary returns {infinities(values)}")

    def learn(self, data: TrainingData, key: np.ndarray) -> SignalSurrogate:
        return self.search(data, key, None)

    def search(
        self, data: TrainingData, key: np.ndarray, previous: SignalSurrogate | None
    ) -> SignalSurrogate:
        _, output, scale = data.observed
        if previous is not None and previous.emulator.goes_on(previous.scale.of(data.features)):
            scale = previous.scale
        else:
            previous = None
            if self.varying_noise and isinstance(scale, Plain):
                scale = stretched(scale, data.u, data.features, output.layout.channel)
        features, units = scale.of(data.features), scale.unit(output)
        old = None if previous is None else previous.emulator
        # what goes on keeps what it has of cheap runs
        cheap = self._cheap_features(data, scale) if old is None else None
        limits = EmulatorLimits(self.components, self.predicted, scale.left, cheap)
        emulator = emulate(data.u, features, units, limits, old, data.tails)
        if old is None and self.varying_noise:
            emulator = resized(emulator, units)
        success = learn_success(data.runs, data.tails)

        def compared(at: np.ndarray | None) -> SignalSurrogate:
            """With what was observed, its noise being right around the features `at` [m]."""
            seen, given = scale.seen(at)
            found = observe(emulator, output, seen, given, self.misfit, previous)
            return replace(found, success=success, scale=scale)

        found = compared(None)
        for _ in range(scale.rounds - 1):
            found = compared(found.best_features)
        return found
