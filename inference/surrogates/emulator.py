"""An emulator of vectors: principal components, a Gaussian process for each score."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._lazy import stats
from ..gp.hyperparameters import GROWTH, maximum_a_posteriori
from ..gp.namespaces import namespace
from ..gp.optimise import minimise_in_box
from ..gp.process import (
    GP,
    MIN_VARIANCE,
    Cheap,
    Data,
    Hyper,
    condition,
    coordinates,
    leave_one_out,
    leave_one_out_errors,
    leave_one_out_log_densities,
    predict,
    predict_mean,
)
from .measurement_noise import MIN_SIZE, ROUNDING, Remainder, shrunk_covariance
from .squared_difference import independent

EXPLAINED_SHARE = 0.9995  # of the variance, to be explained by components
EXPLAINED_IF_EXACT = 0.99999  # the same of a simulator that makes no noise
SMALL_SHARE = 0.25  # of the variance, that is emulated though no parameter predicts it
PREDICTED_SHARE = 0.3  # see `_predicted`
PRIOR_RUNS = 5.0  # runs that speak for uncorrelated scores
MAX_ABSORBED_SHARE = 0.9  # of a score that may count as its own run's noise
FIRST_REPLICATES = 2  # replicates to begin with, which tell a deterministic simulator
EQUAL_RUNS_TOLERANCE = 1e-9  # relative difference up to which two runs count as equal
TOO_SMALL = 0.01  # probability that repeated runs differ by less than they may
# of run-to-run noise whose size depends on the parameters
MIN_NOISE_SHARE = 0.01  # share of noise in the outputs' variance from which its size may vary
SIZE_ROUNDS = 2  # of learning sizes from errors, and the emulator with these sizes
LEAST_OF_ERROR = 0.05  # of an expected squared error, added before its logarithm is taken
NEEDED_NATS = 12.0  # log predictive density that a size by parameters must gain over a constant one
NEEDED_OF_CHEAP = 4.0  # nats of a score's log predictive density that cheap runs must gain
SHIFT_SD, MAX_SHIFT = 0.1, 0.3  # of a cheap simulator's coordinates, the box's width being 1
FIXED = np.log(0.7), 0.0, np.log(0.7)  # length, amplitude and noise of the process that asks first

Units = Callable[[np.ndarray], np.ndarray]
"""Outputs [n, m] -> [m], what makes values comparable."""


class Basis(NamedTuple):
    """Output = centre + scale * (vectors @ scores), scores of unit variance.

    Shapes: m values of an output; k components, of which the last `k - used` are empty.
    """

    centre: np.ndarray  # [m]
    scale: np.ndarray  # [m], what makes values of different kind comparable
    vectors: np.ndarray  # [m, k], orthogonal; each as long as its score's sd
    used: int
    explained: float  # share of the variance

    @property
    def squared(self) -> np.ndarray:
        """Squared lengths of the vectors [k]: variances of the components, 0 of empty ones."""
        return np.sum(self.vectors**2, 0)

    def only(self, kept: np.ndarray) -> "Basis":
        """The basis with the components `kept`, bool [k], in front and all others empty."""
        squared = self.squared
        vectors = np.zeros_like(self.vectors)
        vectors[:, : kept.sum()] = self.vectors[:, kept]
        share = squared[kept].sum() / squared.sum() if squared.any() else 1.0
        return self._replace(
            vectors=vectors, used=int(kept.sum()), explained=self.explained * float(share)
        )

    def standardise(self, outputs: np.ndarray) -> np.ndarray:
        """Outputs [n, m] less the centre, in units of the scale."""
        return (outputs - self.centre) / self.scale

    def scores(self, outputs: np.ndarray) -> np.ndarray:
        """Scores [n, k] of outputs [n, m]; 0 for empty components."""
        return self.standardise(outputs) @ self.vectors / _divisor(self.squared)

    def outputs(self, scores: np.ndarray) -> np.ndarray:
        """Outputs [n, m] of scores [k, n]."""
        return self.centre + self.scale * (scores.T @ self.vectors.T)

    def residuals(self, outputs: np.ndarray) -> np.ndarray:
        """Standardised outputs less their components, [n, m]."""
        return self.standardise(outputs) - self.scores(outputs) @ self.vectors.T


def _divisor(variance: np.ndarray) -> np.ndarray:
    return np.where(variance > 0, variance, 1.0)


def principal_components(
    outputs: np.ndarray,
    scale: np.ndarray,
    capacity: int,
    share: float,
    spread: np.ndarray | None = None,
) -> Basis:
    """The fewest components that explain a share of the outputs' variance.

    Args:
        outputs: [n, m], n >= 2.
        scale: [m], positive.
        capacity: Components at most; the arrays hold as many, and min(capacity, m) at most.
        share: Of the variance, to be explained.
        spread: Variance of each run's noise [n], by which runs count less; None for equal ones.
    """
    weight = np.ones(len(outputs)) if spread is None else np.mean(spread) / spread
    centre = outputs.mean(0) if spread is None else np.average(outputs, axis=0, weights=weight)
    standard = (outputs - centre) / scale * np.sqrt(weight / weight.mean())[:, None]
    # what varies by rounding error alone does not vary
    standard = np.where(np.abs(outputs - centre) > 1e-12 * np.abs(outputs), standard, 0.0)
    n, m = standard.shape
    # from the smaller side: simulations are usually fewer than values, earlier ones may be more
    smaller = standard if n <= m else standard.T
    values, left = np.linalg.eigh(smaller @ smaller.T / n)
    values, left = np.maximum(values[::-1], 0.0), left[:, ::-1]
    total = values.sum()
    capacity = min(capacity, m)
    tail = total - np.cumsum(values)
    enough = int(np.argmax(tail <= (1.0 - share) * total)) + 1
    # directions of no more than rounding error are none
    used = int(min(enough, capacity, np.sum(values > 1e-12 * total)))
    vectors = np.zeros((m, capacity))
    if n <= m:
        vectors[:, :used] = standard.T @ left[:, :used] / np.sqrt(n)
    else:
        vectors[:, :used] = left[:, :used] * np.sqrt(values[:used])
    explained = float(1.0 - tail[used - 1] / total) if used else 1.0
    found = Basis(centre, scale, vectors, used, explained)
    if spread is None:
        return found
    # scores of unit variance over all runs, as the processes' priors mean
    return found._replace(vectors=vectors * np.sqrt(np.mean(found.scores(outputs) ** 2, 0)))


class Size(NamedTuple):
    """Log of the run-to-run noise's size at u: a process's mean, within what was found at runs."""

    gp: GP
    low: np.ndarray  # []
    high: np.ndarray  # []

    def log(self, u: Any) -> Any:
        """Log of the size [n] at u [n, d]."""
        return namespace(u).clip(predict_mean(self.gp, u)[0], self.low, self.high)


class CheapRuns(NamedTuple):
    """Successful runs of a cheaper simulator of the same output."""

    u: np.ndarray  # [n, d]
    outputs: np.ndarray  # [n, m]


class EmulatorLimits(NamedTuple):
    """Limits of an emulator.

    Attributes:
        components: At most.
        predicted: Share of a component's variance that the parameters must predict, lest it
            count as noise; None emulates every component.
        left: Variance of a value, in units of its scale, that components may leave at most.
        cheap: Runs of a cheaper simulator, to be used where they help.
    """

    components: int
    predicted: float | None = PREDICTED_SHARE
    left: float = np.inf
    cheap: CheapRuns | None = None


class Emulator(NamedTuple):
    """Emulator of the simulator's output, whatever was observed.

    Attributes:
        gp: One process for each of k scores; the empty ones are flat.
        basis: Of the outputs.
        remainder: Covariance of what the components leave.
        noise: Covariance [k, k] of the scores' run-to-run noise, beyond the remainder's.
        outputs: What was learned from [n, m].
        learned_at: Simulations known when components and hyperparameters were found.
        excess: Of those simulations' scores, see `_absorbed_noise` [k].
        limits: How much it may hold.
        size: How the run-to-run noise depends on the parameters; None where it does not.
            `remainder` and `noise` hold for the size 1.
    """

    gp: GP
    basis: Basis
    remainder: Remainder
    noise: np.ndarray
    outputs: np.ndarray
    learned_at: int
    excess: np.ndarray
    limits: EmulatorLimits
    size: Size | None = None

    @property
    def equal(self) -> bool:
        """Whether all outputs are the same."""
        return self.basis.used == 0 and self.remainder.total <= ROUNDING * len(self.basis.scale)

    @property
    def scores(self) -> GP:
        """The processes of the components in use."""
        return self.gp.only(slice(self.basis.used))

    @property
    def repeats(self) -> np.ndarray:
        """Of each run at the parameters of one before: whether its output differs, bool [r]."""
        return differing(self.gp.data.u[: len(self.outputs)], self.outputs)

    def spread(self, u: np.ndarray) -> np.ndarray:
        """Variance of the run-to-run noise at u [n, d] over that of the size 1, [n]."""
        found = run_spread(self.size, u)
        return np.ones(len(u)) if found is None else found

    def mean(self, u: np.ndarray) -> np.ndarray:
        """Mean of the outputs at u [n, d]: [n, m]."""
        return self.basis.outputs(predict(self.gp, u)[0])

    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd, run-to-run noise included, of the outputs at u [n, d]: [n, m] each."""
        basis, remainder = self.basis, self.remainder
        mean, variance = predict(self.gp, u)
        constant = np.sum(remainder.factors**2, 1) + remainder.white
        constant = constant + np.sum((basis.vectors @ self.noise) * basis.vectors, 1)
        sd = np.sqrt(variance.T @ basis.vectors.T**2 + self.spread(u)[:, None] * constant)
        return basis.outputs(mean), basis.scale * sd

    def latent_covariance(self, u: np.ndarray) -> np.ndarray:
        """Covariance [m, m] of the emulator's own error in the mean output at u [d], without
        run-to-run noise."""
        basis = self.basis
        variance = predict(self.gp, u[None])[1][:, 0]
        standard = (basis.vectors * variance) @ basis.vectors.T
        return standard * np.outer(basis.scale, basis.scale)

    def draw(self, rng: np.random.Generator, u: np.ndarray) -> np.ndarray:
        """A new simulated output, run-to-run noise included, for each row of u [n, d]: [n, m]."""
        basis, remainder = self.basis, self.remainder
        mean, variance = (part.T for part in predict(self.gp, u))
        full = np.any(basis.vectors, 0)
        latent, noisy = rng.normal(size=mean.shape), rng.normal(size=mean.shape)
        factor = rng.normal(size=(len(u), remainder.factors.shape[1]))
        white = rng.normal(size=(len(u), len(basis.scale)))
        values, vectors = np.linalg.eigh(self.noise)
        noisy = noisy @ (vectors * np.sqrt(np.maximum(values, 0.0))).T * full
        size = np.sqrt(self.spread(u))[:, None]
        scores = (mean + np.sqrt(variance) * latent) * full + size * noisy
        left = factor @ remainder.factors.T + np.sqrt(remainder.white) * white
        return basis.centre + basis.scale * (scores @ basis.vectors.T + size * left)

    def left_out(self) -> np.ndarray:
        """Leave-one-out predictions, components and hyperparameters kept: [n, m]."""
        return self.basis.outputs(leave_one_out(self.gp)[0])

    def loo_errors(self) -> np.ndarray:
        """Studentised leave-one-out errors of the scores [n, used], of what was simulated."""
        return leave_one_out_errors(self.scores, len(self.outputs))

    @property
    def noise_share(self) -> float:
        """Share of the outputs' variance that no parameter predicts: run-to-run noise."""
        used, rest = self.basis.used, self.remainder.total
        weight = self.basis.squared[:used]  # their scores have unit variance
        spread = float(np.mean(self.gp.data.noise(0.0)))
        noise, rest = spread * np.exp(2.0 * self.gp.hyper.log_noise[:used]), spread * rest
        total = weight.sum() + rest
        return float((weight @ np.minimum(noise, 1.0) + rest) / total) if total > 0 else 0.0

    @property
    def noise_variance(self) -> float:
        """Variance of the run-to-run noise of size 1, summed over the standardised values."""
        return self.remainder.total + float(np.diag(self.noise) @ self.basis.squared)

    @property
    def borne_out(self) -> float:
        """The largest share of the run-to-run noise that repeated runs allow; 1 where none were
        made.

        Half the squared differences of two runs are a sample of its variance.
        """
        u, whole = self.gp.data.u[: len(self.outputs)], self.noise_variance
        first, second = repeated(u)
        if not len(first) or not whole:
            return 1.0
        differences = (self.outputs[first] - self.outputs[second]) / self.basis.scale
        sample = np.sum(differences**2, 1) / (2.0 * self.spread(u[first]))
        freedom = sum(independent(one) for one in differences)
        most = sample.mean() * freedom / stats.chi2.ppf(TOO_SMALL, freedom)
        return float(min(1.0, most / whole))

    def smallest_misfit(self, observed: np.ndarray, u: np.ndarray) -> float:
        """Root of the least expected mean square by which the emulated output at u [n, d] misses
        the observed values [m], standardised."""
        basis = self.basis
        mean, variance = (part.T for part in predict(self.gp, u))
        near = (mean - basis.scores(observed[None])) ** 2 + variance
        # components are orthogonal, so what they miss adds to what they cannot make
        total = (near @ basis.squared).min() + np.sum(basis.residuals(observed[None]) ** 2)
        return float(max(np.sqrt(total / len(observed)), MIN_SIZE))

    def goes_on(self, outputs: np.ndarray) -> bool:
        """Whether outputs [n, m] begin with those that it was learned from, and are not many
        more."""
        n = self.learned_at
        return n <= len(outputs) < GROWTH * n and np.array_equal(self.outputs[:n], outputs[:n])


def run_spread(size: Size | None, u: np.ndarray) -> np.ndarray | None:
    """The noise's variance at u [n, d] over that of the size 1, [n]; None where it is constant."""
    return None if size is None else np.exp(2.0 * size.log(u))


def repeated(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of runs at equal u [n, d], and of the run before each."""
    _, which = np.unique(u, axis=0, return_inverse=True)
    order = np.argsort(which.ravel(), kind="stable")
    same = np.flatnonzero(np.diff(which.ravel()[order]) == 0)
    return order[same], order[same + 1]


def differing(u: np.ndarray, outputs: np.ndarray) -> np.ndarray:
    """Of each run at u [n, d] of one before: whether its output [n, m] differs, bool [r]."""
    first, again = repeated(u)
    differ = np.abs(outputs[again] - outputs[first])
    return (differ > EQUAL_RUNS_TOLERANCE * outputs.std(0)).any(1)


def deterministic(u: np.ndarray, outputs: np.ndarray) -> bool:
    """Whether FIRST_REPLICATES or more repeated runs agree."""
    differ = differing(u, outputs)
    return len(differ) >= FIRST_REPLICATES and not differ.any()


def emulate(
    u: np.ndarray,
    outputs: np.ndarray,
    units: Units,
    limits: EmulatorLimits,
    previous: Emulator | None = None,
    tails: np.ndarray | None = None,
) -> Emulator:
    """Learn outputs [n, m] at u [n, d].

    Args:
        units: Scales of the values.
        limits: Of components and data.
        previous: Learned from the first of these data; its components and hyperparameters are
            kept until the data have grown by GROWTH.
        tails: Ends at which the parameters fade out [d], see `gp.process.coordinates`.
    """
    if previous is None or not previous.goes_on(outputs):
        return _learned(Data(u, outputs.T, tails), units, limits)
    spread = run_spread(previous.size, u)
    targets = _targets(previous.basis, outputs, previous.learned_at, previous.excess)
    gp = condition(previous.gp.hyper, Data(u, targets, tails, spread), previous.gp.prior)
    kept = previous._replace(outputs=outputs)
    return _with_noise(kept, gp, _left(previous.basis, outputs, spread))


def _learned(
    known: Data, units: Units, limits: EmulatorLimits, size: Size | None = None
) -> Emulator:
    """Components and hyperparameters of outputs known.y [m, n], the run-to-run noise being of a
    known size."""
    outputs, n, spread = known.y.T, len(known.u), run_spread(size, known.u)
    scale, exact = units(outputs), deterministic(known.u, outputs)
    share = EXPLAINED_IF_EXACT if exact else EXPLAINED_SHARE
    varied = float(np.mean(np.var(outputs, axis=0) / scale**2))
    share = max(share, 1.0 - limits.left / varied) if varied else share
    basis = principal_components(outputs, scale, limits.components, share, spread)
    data = known._replace(y=basis.scores(outputs).T, spread=spread)
    hyper, prior = maximum_a_posteriori(data), None
    if limits.cheap is not None:
        u, made = limits.cheap
        hyper, prior = _helped(hyper, data, CheapRuns(u, basis.scores(made)), basis.squared)
    if limits.predicted is not None:
        order, kept = _predicted(condition(hyper, data, prior), limits.predicted)
        # what is not predicted is no noise where runs agree; much of it means a chaotic simulator
        small = basis.squared[~kept].sum() <= SMALL_SHARE * basis.squared.sum()
        if not (exact and small):
            basis, hyper = basis.only(kept), Hyper(*(part[order] for part in hyper))
            prior = prior and prior.only(order)
    remainder = _left(basis, outputs, spread)
    excess = _absorbed_noise(basis, np.exp(2.0 * hyper.log_noise), remainder, n)
    smaller = np.log1p(-excess)
    hyper = Hyper(hyper.log_length, hyper.log_amplitude + smaller, hyper.log_noise + smaller)
    if prior is not None:
        slope, offset = ((1.0 - excess) * part for part in (prior.slope, prior.offset))
        prior = prior._replace(slope=slope, offset=offset)
    gp = condition(hyper, data._replace(y=_targets(basis, outputs, n, excess)), prior)
    found = Emulator(gp, basis, remainder, np.zeros(0), outputs, n, excess, limits, size)
    return _with_noise(found, gp, remainder)


def _targets(basis: Basis, outputs: np.ndarray, learned_at: int, excess: np.ndarray) -> np.ndarray:
    """Scores [k, n]; of the first ones, from which the components came, less the excess."""
    scores = basis.scores(outputs)
    scores[:learned_at] *= 1.0 - excess
    return scores.T


def _left(basis: Basis, outputs: np.ndarray, spread: np.ndarray | None) -> Remainder:
    """Covariance of outputs [n, m] less their components, for noise of the size 1."""
    residuals = basis.residuals(outputs)
    if spread is not None:  # scaled to one length: unlike sizes would look like correlation
        length = np.linalg.norm(residuals, axis=1)
        mean = np.sqrt(np.mean(length**2 / spread))
        residuals = residuals * (mean / _divisor(length))[:, None]
    return shrunk_covariance(residuals, basis.used + 1)


def _with_noise(emulator: Emulator, gp: GP, remainder: Remainder) -> Emulator:
    """The emulator with these processes, and with the noise that was wrongly attributed to the
    components in the remainder."""
    basis, noise = emulator.basis, np.exp(2.0 * gp.hyper.log_noise)
    taken = np.sum(noise * ((1.0 - emulator.excess) ** -2 - 1.0) * basis.squared)
    remainder = remainder._replace(white=remainder.white + float(taken) / len(basis.vectors))
    noise = _run_to_run(gp, basis, remainder.white, len(emulator.outputs))
    return emulator._replace(gp=gp, remainder=remainder, noise=noise)


def _helped(
    hyper: Hyper, data: Data, cheap: CheapRuns, weight: np.ndarray
) -> tuple[Hyper, Cheap | None]:
    """Hyperparameters of the scores, and what is expected of them by cheap runs.

    Cheap runs are used for those scores that they predict better where a run is left out, at
    shifted parameters, with the slope and offset of least squares. If there are none, no bit
    changes.

    Args:
        hyper: Without cheap runs.
        data: Scores.
        cheap: Scores of cheap runs for outputs [n, k].
        weight: Of the scores [k], their components' variances.
    """
    u, scores = cheap
    there, at = coordinates(u, data.tails), coordinates(data.u, data.tails)
    known = Data(there, ((scores - scores.mean(0)) / _divisor(scores.std(0))).T)
    gp = condition(maximum_a_posteriori(known), known)
    gp = condition(gp.hyper, known._replace(u=there - _shift(gp, at, data.y, weight)))
    x, y = predict_mean(gp, at), data.y
    varied = x - x.mean(1, keepdims=True)
    slope = np.sum(varied * y, axis=1) / _divisor(np.sum(varied**2, axis=1))
    offset = np.mean(y - slope[:, None] * x, axis=1)
    rest = y - offset[:, None] - slope[:, None] * x
    unit = _divisor(rest.std(1))
    length, amplitude, noise = maximum_a_posteriori(data._replace(y=rest / unit[:, None]))
    own = Hyper(length, amplitude + np.log(unit), noise + np.log(unit))
    prior = Cheap(gp, slope, offset, unit)
    beside, alone = condition(own, data, prior), condition(hyper, data)
    densities = leave_one_out_log_densities(beside), leave_one_out_log_densities(alone)
    helps = densities[0].sum(1) - densities[1].sum(1) > NEEDED_OF_CHEAP
    if not helps.any():
        return hyper, None
    found = [np.where(helps, a.T, b.T).T for a, b in zip(own, hyper, strict=True)]
    return Hyper(*found), Cheap(gp, helps * slope, helps * offset, np.where(helps, unit, 1.0))


def _shift(gp: GP, at: np.ndarray, y: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Shift [d] of coordinates with which cheap processes explain most of scores y [k, n].

    The space mapping of Bandler et al. (1994, IEEE Trans. Microw. Theory Tech. 42, 2536) in its
    simplest form: what coarse cells or long steps change is often what another value of a parameter
    would, such as a larger viscosity. The most likely one, with slope and offset of least squares.

    Args:
        gp: Cheap processes, over coordinates.
        at: Coordinates of the scores [n, d].
        weight: Of the scores [k].
    """
    (n, d), y = at.shape, y - y.mean(1, keepdims=True)

    def minus_log_posterior(shift: np.ndarray) -> float:
        x = predict_mean(gp, at + shift)
        x = x - x.mean(1, keepdims=True)
        explained = np.sum(x * y, 1) ** 2 / _divisor(np.sum(x**2, 1))
        left = weight @ (np.sum(y**2, 1) - explained)
        penalty = 0.5 * np.sum((shift / SHIFT_SD) ** 2)
        return float(0.5 * n * np.log(np.maximum(left, MIN_VARIANCE)) + penalty)

    def in_box(u: np.ndarray) -> np.ndarray:
        return MAX_SHIFT * (2.0 * u - 1.0)

    found = minimise_in_box(lambda u: np.array([minus_log_posterior(s) for s in in_box(u)]), d)
    return in_box(found)


def _predicted(gp: GP, least: float) -> tuple[np.ndarray, np.ndarray]:
    """The order in which the components that the parameters predict are in front, [k], and which
    these are, bool [k].

    Of a noisy simulator's components most are noise. In few runs it may look like structure, by
    chance in one component out of several, and the likelihood then has bumps where there is
    nothing to be seen. So a component whose scores are hardly predicted when their runs are left
    out is left to the remainder: it could tell little, less than 0.2 nats of the parameters.
    """
    kept = _predicted_share(gp) > least
    return np.argsort(~kept, kind="stable"), kept


def _predicted_share(gp: GP) -> np.ndarray:
    """Share of each score's variance that is predicted when a run is left out, [k].

    Not above 0 where the mean of the others would do as well, and 0 for empty components. Runs
    count the less the noisier they are.
    """
    score, weight = gp.data.y, 1.0 / gp.data.noise(0.0)
    error = score - leave_one_out(gp)[0]
    mean = (score @ weight / weight.sum())[:, None]
    from_mean = (score - mean) * weight.sum() / (weight.sum() - weight)  # of the other scores
    total = from_mean**2 @ weight
    return np.where(total > 0, 1.0 - error**2 @ weight / _divisor(total), 0.0)


def _run_to_run(gp: GP, basis: Basis, white: float, n: int) -> np.ndarray:
    """Covariance [k, k] of the scores' run-to-run noise, less the white noise's part in it.

    Sizes are the processes' own noise, to which replicates testify; correlations are those of
    what the processes count as noise, shrunk.
    """
    squared = basis.squared
    full = squared > 0
    variance = np.exp(2.0 * gp.hyper.log_noise) * full
    variance = np.maximum(variance - white / np.where(full, squared, np.inf), 0.0)
    spread = gp.data.noise(0.0)
    residual = np.where(full[:, None], gp.weights * np.sqrt(spread), 0.0)
    residual = residual / _divisor(np.sqrt(np.sum(residual**2, 1, keepdims=True)))
    correlation = residual @ residual.T * n / (n + PRIOR_RUNS)
    np.fill_diagonal(correlation, 1.0)
    sd = np.sqrt(variance)
    return correlation * np.outer(sd, sd)


def _absorbed_noise(basis: Basis, noise: np.ndarray, remainder: Remainder, n: int) -> np.ndarray:
    """Share [k] of the scores of n runs that is these runs' own noise.

    A principal component leans towards the noise of the runs that it is computed from, so their
    scores contain that noise and a new run's do not: to first order by the noise's variance
    across the component over n times the component's variance (Nadler 2008, finite sample
    perturbation of principal components). Without a correction the emulator is too steep by that
    share, most of all in the weak components of few, long and noisy outputs.

    Args:
        noise: Run-to-run variances of the scores [k].
        remainder: What the components leave.
    """
    squared = basis.squared
    total = np.sum(noise * squared) + remainder.total
    across = np.maximum(total - noise * squared, 0.0)
    share = np.where(squared > 0.0, across / (n * _divisor(squared)), 0.0)
    return np.minimum(share, MAX_ABSORBED_SHARE)


def resized(emulator: Emulator, units: Units) -> Emulator:
    """The emulator with run-to-run noise whose size depends on the parameters, if errors show it.

    Goldberg et al. (1998), with the most likely size: a process of the logarithm of each run's
    leave-one-out error. Where nothing is gained, noise is next to none, or no runs of equal
    parameters differ, no bit changes.

    Args:
        units: As for `emulate`.
    """
    found = emulator
    if emulator.noise_share < MIN_NOISE_SHARE or not emulator.repeats.any():
        return emulator
    data = emulator.gp.data
    for _ in range(SIZE_ROUNDS):
        size = learn_size(_log_sizes(found), data.u, data.tails)
        if size is None:
            break
        found = _learned(Data(data.u, found.outputs.T, data.tails), units, found.limits, size)
    return found


def _log_sizes(emulator: Emulator) -> np.ndarray:
    """Log of the size of each run's noise, as its leave-one-out error shows it [n]."""
    basis, gp = emulator.basis, emulator.scores
    mean, variance = leave_one_out(gp)
    squared = basis.squared[: basis.used]
    spread = emulator.gp.data.noise(0.0)
    due = squared @ variance + emulator.remainder.total * spread
    residuals = basis.residuals(emulator.outputs)
    found = squared @ (gp.data.y - mean) ** 2 + np.sum(residuals**2, 1)
    return 0.5 * np.log(spread * (found / due + LEAST_OF_ERROR))


def learn_size(log_sizes: np.ndarray, u: np.ndarray, tails: np.ndarray | None) -> Size | None:
    """The size as a smooth function of the parameters; None where a constant predicts as well.

    What predicts a run's size must do so where the run is left out. A process of fixed
    hyperparameters is asked first: where the size is constant, nothing is optimised.

    Args:
        log_sizes: Of the noise of each run [n], with an error of their own.
        u: Prior quantiles [n, d].
        tails: As of `Data`.
    """
    centre, sd = log_sizes.mean(), log_sizes.std()
    if not sd > 0.0:
        return None
    data = Data(u, ((log_sizes - centre) / sd)[None], tails)
    length, amplitude, noise = FIXED
    fixed = Hyper(np.full((1, u.shape[1]), length), np.array([amplitude]), np.array([noise]))
    if _gain(condition(fixed, data)) < NEEDED_NATS:
        return None
    gp = condition(maximum_a_posteriori(data), data)
    if _gain(gp) < NEEDED_NATS:
        return None
    gp = gp._replace(weights=gp.weights * sd)
    found = predict_mean(gp, u)[0]
    return Size(gp, found.min(), found.max())


def _gain(gp: GP) -> float:
    """Log predictive density that the parameters gain where each run is left out, over the mean of
    all others; Gaussian errors of the best sd."""
    n, y = len(gp.data.u), gp.data.y
    error = y - leave_one_out(gp)[0]
    from_mean = (y - y.mean()) * n / (n - 1)
    return 0.5 * n * float(np.log(np.sum(from_mean**2) / np.sum(error**2)))
