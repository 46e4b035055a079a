"""An emulator of vectors: principal components, a Gaussian process for each score."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .._lazy import stats
from ..gp.hyperparameters import GROWTH, maximum_a_posteriori
from ..gp.process import (
    GP,
    Data,
    Hyper,
    condition,
    leave_one_out,
    leave_one_out_errors,
)
from ..gp.process import predict as predict_scores
from .components import Basis, principal_components
from .measurement_noise import MIN_SIZE, Remainder, shrunk_covariance
from .noise.run_size import EQUAL_RUNS_TOLERANCE, Size, learn_size, run_spread
from .noise.scales import repeated
from .squared_difference import independent

EXPLAINED_SHARE = 0.9995  # of the variance, to be explained by components
PREDICTED_SHARE = 0.3  # see `_predicted`
PRIOR_RUNS = 5.0  # runs that speak for uncorrelated scores
MIN_NOISE_SHARE = 0.01  # share of noise in the outputs' variance from which its size may vary
SIZE_ROUNDS = 2  # of learning sizes from errors, and the emulator with these sizes
TOO_SMALL = 0.01  # probability that repeated runs differ by less than they may
MAX_ABSORBED_SHARE = 0.9  # of a score that may count as its own run's noise
LEAST_OF_ERROR = 0.05  # of an expected squared error, added before its logarithm is taken


class EmulatorLimits(NamedTuple):
    """Limits of an emulator.

    Attributes:
        components: At most.
        predicted: Share of a component's variance that the parameters must predict, lest it
            count as noise; None emulates every component.
        left: Variance of a value, in units of its scale, that components may leave at most.
    """

    components: int
    predicted: float | None = PREDICTED_SHARE
    left: float = np.inf


class Emulator(NamedTuple):
    """Emulator of the simulator's output, whatever was observed.

    Attributes:
        gp: One process for each of k scores; the empty ones are flat.
        basis: Of the outputs.
        remainder: Covariance of what the components leave.
        noise: Covariance [k, k] of the scores' run-to-run noise, beyond the remainder's.
        outputs: What was learned from [n, m].
        learned_at: Simulations known when components and hyperparameters were found.
        excess: Of those simulations' scores, see `absorbed_noise` [k].
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
        return self.basis.used == 0 and self.remainder.total == 0.0

    @property
    def repeats(self) -> np.ndarray:
        """Of each run at the parameters of one before: whether its output differs, bool [r]."""
        first, again = repeated(self.gp.data.u[: len(self.outputs)])
        differ = np.abs(self.outputs[again] - self.outputs[first])
        return (differ > EQUAL_RUNS_TOLERANCE * self.outputs.std(0)).any(1)


def emulate(
    u: np.ndarray,
    outputs: np.ndarray,
    scale: Callable[[np.ndarray], np.ndarray],
    limits: EmulatorLimits,
    previous: Emulator | None = None,
    normal: np.ndarray | None = None,
) -> Emulator:
    """Learn outputs [n, m] at u [n, d].

    Args:
        scale: Outputs [n, m] -> [m], what makes values comparable.
        limits: Of components and data.
        previous: Learned from the first of these data; its components and hyperparameters are
            kept until the data have grown by GROWTH.
        normal: Which parameters the kernels see as normal scores [d], see `gp.process.coordinates`.
    """
    if previous is None or not goes_on(previous, outputs):
        return _learned(Data(u, outputs.T, normal), scale, limits)
    basis, learned_at, excess = previous.basis, previous.learned_at, previous.excess
    spread = run_spread(previous.size, u)
    targets = _targets(basis, outputs, learned_at, excess)
    gp = condition(previous.gp.hyper, Data(u, targets, normal, spread))
    kept = previous._replace(outputs=outputs)
    return _with_noise(kept, gp, _left(basis, outputs, spread))


def _learned(
    known: Data,
    scale: Callable[[np.ndarray], np.ndarray],
    limits: EmulatorLimits,
    size: Size | None = None,
) -> Emulator:
    """Components and hyperparameters of outputs known.y [m, n], the run-to-run noise being of a
    known size."""
    outputs, n, spread = known.y.T, len(known.u), run_spread(size, known.u)
    units = scale(outputs)
    varied = float(np.mean(np.var(outputs, axis=0) / units**2))
    share = max(EXPLAINED_SHARE, 1.0 - limits.left / varied) if varied else EXPLAINED_SHARE
    components = principal_components(outputs, units, limits.components, share, spread)
    data = known._replace(y=components.scores(outputs).T, spread=spread)
    basis, hyper = components, maximum_a_posteriori(data)
    if limits.predicted is not None:
        basis, hyper = _predicted(basis, hyper, data, limits.predicted)
    remainder = _left(basis, outputs, spread)
    excess = absorbed_noise(basis, np.exp(2.0 * hyper.log_noise), remainder, n)
    smaller = np.log1p(-excess)
    hyper = Hyper(hyper.log_length, hyper.log_amplitude + smaller, hyper.log_noise + smaller)
    gp = condition(hyper, data._replace(y=_targets(basis, outputs, n, excess)))
    found = Emulator(gp, basis, remainder, np.zeros(0), outputs, n, excess, limits, size)
    return _with_noise(found, gp, remainder)


def _left(basis: Basis, outputs: np.ndarray, spread: np.ndarray | None) -> Remainder:
    """Covariance of outputs [n, m] less their components, for noise of the size 1."""
    residuals = basis.residuals(outputs)
    if spread is not None:  # scaled to one length: unlike sizes would look like correlation
        length = np.linalg.norm(residuals, axis=1)
        mean = np.sqrt(np.mean(length**2 / spread))
        residuals = residuals * (mean / np.where(length > 0.0, length, 1.0))[:, None]
    return shrunk_covariance(residuals, basis.used + 1)


def _with_noise(emulator: Emulator, gp: GP, remainder: Remainder) -> Emulator:
    basis = emulator.basis
    remainder = left_over(basis, np.exp(2.0 * gp.hyper.log_noise), remainder, emulator.excess)
    noise = run_to_run(gp, basis, remainder.white, len(emulator.outputs))
    return emulator._replace(gp=gp, remainder=remainder, noise=noise)


def resized(emulator: Emulator, scale: Callable[[np.ndarray], np.ndarray]) -> Emulator:
    """The same with run-to-run noise whose size depends on the parameters, if errors show that.

    Goldberg et al. (1998), with the most likely size: a process of the logarithm of each run's
    leave-one-out error. Where nothing is gained, noise is next to none, or no runs of equal
    parameters differ, no bit changes.

    Args:
        scale: As for `emulate`.
    """
    found = emulator
    if noise_share(emulator) < MIN_NOISE_SHARE or not emulator.repeats.any():
        return emulator
    data = emulator.gp.data
    for _ in range(SIZE_ROUNDS):
        size = learn_size(_log_sizes(found), data.u, data.normal)
        if size is None:
            break
        known = Data(data.u, found.outputs.T, data.normal)
        found = _learned(known, scale, found.limits, size)
    return found


def _log_sizes(emulator: Emulator) -> np.ndarray:
    """Log of the size of each run's noise, as its leave-one-out error shows it [n]."""
    basis, gp = emulator.basis, emulator.gp.only(slice(emulator.basis.used))
    mean, variance = leave_one_out(gp)
    squared = np.sum(basis.vectors[:, : basis.used] ** 2, 0)
    spread = emulator.gp.data.noise(0.0)
    due = squared @ variance + emulator.remainder.total * spread
    residuals = basis.residuals(emulator.outputs)
    found = squared @ (gp.data.y - mean) ** 2 + np.sum(residuals**2, 1)
    return 0.5 * np.log(spread * (found / due + LEAST_OF_ERROR))


def _predicted(basis: Basis, hyper: Hyper, data: Data, least: float) -> tuple[Basis, Hyper]:
    """The components that the parameters predict, and the hyperparameters of their scores.

    Of a noisy simulator's components most are noise. In few runs it may look like structure, by
    chance in one component out of several, and the likelihood then has bumps where there is
    nothing to be seen. So a component whose scores are hardly predicted when their runs are left
    out is left to the remainder: it could tell little, less than 0.2 nats of the parameters.
    """
    kept = predicted_share(condition(hyper, data)) > least
    order = np.argsort(~kept, kind="stable")
    return basis.only(kept), Hyper(*(part[order] for part in hyper))


def predicted_share(gp: GP) -> np.ndarray:
    """Share of each score's variance that is predicted when a run is left out, [k].

    Not above 0 where the mean of the others would do as well, and 0 for empty components. Runs
    count the less the noisier they are.
    """
    score, weight = gp.data.y, 1.0 / gp.data.noise(0.0)
    error = score - leave_one_out(gp)[0]
    mean = (score @ weight / weight.sum())[:, None]
    from_mean = (score - mean) * weight.sum() / (weight.sum() - weight)  # of the other scores
    total = from_mean**2 @ weight
    return np.where(total > 0, 1.0 - error**2 @ weight / np.where(total > 0, total, 1.0), 0.0)


def goes_on(previous: Emulator, outputs: np.ndarray) -> bool:
    """Whether these are the outputs that were learned from, and not many more."""
    n = previous.learned_at
    return n <= len(outputs) < GROWTH * n and np.array_equal(previous.outputs[:n], outputs[:n])


def _targets(basis: Basis, outputs: np.ndarray, learned_at: int, excess: np.ndarray) -> np.ndarray:
    """Scores [k, n]; of the first ones, from which the components came, less the excess."""
    scores = basis.scores(outputs)
    scores[:learned_at] *= 1.0 - excess
    return scores.T


def run_to_run(gp: GP, basis: Basis, white: float, n: int) -> np.ndarray:
    """Covariance [k, k] of the scores' run-to-run noise, less the white noise's part in it.

    Sizes are the processes' own noise, to which replicates testify; correlations are those of
    what the processes count as noise, shrunk.
    """
    squared = np.sum(basis.vectors**2, 0)
    full = squared > 0
    variance = np.exp(2.0 * gp.hyper.log_noise) * full
    variance = np.maximum(variance - white / np.where(full, squared, np.inf), 0.0)
    spread = gp.data.noise(0.0)
    residual = np.where(full[:, None], gp.weights * np.sqrt(spread), 0.0)
    length = np.sqrt(np.sum(residual**2, 1, keepdims=True))
    residual = residual / np.where(length > 0, length, 1.0)
    correlation = residual @ residual.T * n / (n + PRIOR_RUNS)
    np.fill_diagonal(correlation, 1.0)
    sd = np.sqrt(variance)
    return correlation * np.outer(sd, sd)


def absorbed_noise(basis: Basis, noise: np.ndarray, remainder: Remainder, n: int) -> np.ndarray:
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
    squared = np.sum(basis.vectors**2, 0)
    total = np.sum(noise * squared) + remainder.total
    across = np.maximum(total - noise * squared, 0.0)
    share = np.where(squared > 0.0, across / (n * np.where(squared > 0.0, squared, 1.0)), 0.0)
    return np.minimum(share, MAX_ABSORBED_SHARE)


def left_over(
    basis: Basis, noise: np.ndarray, remainder: Remainder, excess: np.ndarray
) -> Remainder:
    """`remainder`, plus the noise wrongly attributed to the components.

    Args:
        noise: Run-to-run variances of the scores, without the excess [k].
    """
    taken = np.sum(noise * ((1.0 - excess) ** -2 - 1.0) * np.sum(basis.vectors**2, 0))
    return remainder._replace(white=remainder.white + float(taken) / len(basis.vectors))


def loo_errors(emulator: Emulator) -> np.ndarray:
    """Studentised leave-one-out errors of the scores [n, used], of what was simulated."""
    gp = emulator.gp.only(slice(emulator.basis.used))
    return leave_one_out_errors(gp, len(emulator.outputs))


def noise_share(emulator: Emulator) -> float:
    """Share of the outputs' variance that no parameter predicts: run-to-run noise."""
    used, rest = emulator.basis.used, emulator.remainder.total
    weight = np.sum(emulator.basis.vectors[:, :used] ** 2, 0)  # their scores have unit variance
    spread = float(np.mean(emulator.gp.data.noise(0.0)))
    noise, rest = spread * np.exp(2.0 * emulator.gp.hyper.log_noise[:used]), spread * rest
    total = weight.sum() + rest
    return float((weight @ np.minimum(noise, 1.0) + rest) / total) if total > 0 else 0.0


def noise_variance(emulator: Emulator) -> float:
    """Of the run-to-run noise, at its size 1, over all standardised values together."""
    squared = np.sum(emulator.basis.vectors**2, 0)
    return emulator.remainder.total + float(np.diag(emulator.noise) @ squared)


def borne_out(emulator: Emulator) -> float:
    """The largest share of the run-to-run noise that repeated runs allow; 1 where none were made.

    Half the squared differences of two runs are a sample of its variance.
    """
    u, outputs = emulator.gp.data.u[: len(emulator.outputs)], emulator.outputs
    first, second = repeated(u)
    whole = noise_variance(emulator)
    if not len(first) or not whole:
        return 1.0
    differences = (outputs[first] - outputs[second]) / emulator.basis.scale
    sample = np.sum(differences**2, 1) / (2.0 * _spread(emulator, u[first]))
    freedom = sum(independent(one) for one in differences)
    return float(min(1.0, sample.mean() * freedom / stats.chi2.ppf(TOO_SMALL, freedom) / whole))


def smallest_misfit(emulator: Emulator, observed: np.ndarray, u: np.ndarray) -> float:
    """Root of the least expected mean square by which the emulated output at u [n, d] misses the
    observed values [m], standardised."""
    basis = emulator.basis
    mean, variance = (part.T for part in predict_scores(emulator.gp, u))
    near = (mean - basis.scores(observed[None])) ** 2 + variance
    # components are orthogonal, so what they miss adds to what they cannot make
    beyond = np.sum(basis.residuals(observed[None]) ** 2)
    total = (near @ np.sum(basis.vectors**2, 0)).min() + beyond
    return float(max(np.sqrt(total / len(observed)), MIN_SIZE))


def mean(emulator: Emulator, u: np.ndarray) -> np.ndarray:
    """Mean of the outputs at u [n, d]: [n, m]."""
    return _outputs(emulator.basis, predict_scores(emulator.gp, u)[0])


def left_out(emulator: Emulator) -> np.ndarray:
    """Leave-one-out predictions, components and hyperparameters kept: [n, m]."""
    return _outputs(emulator.basis, leave_one_out(emulator.gp)[0])


def _spread(emulator: Emulator, u: np.ndarray) -> np.ndarray:
    """As `run_spread`, 1 where the size is constant."""
    found = run_spread(emulator.size, u)
    return np.ones(len(u)) if found is None else found


def _outputs(basis: Basis, scores: np.ndarray) -> np.ndarray:
    """Outputs [n, m] of scores [k, n]."""
    return basis.centre + basis.scale * (scores.T @ basis.vectors.T)


def predict(emulator: Emulator, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sd, run-to-run noise included, of the outputs at u [n, d]: [n, m] each."""
    basis, remainder = emulator.basis, emulator.remainder
    mean, variance = (part.T for part in predict_scores(emulator.gp, u))
    constant = np.sum(remainder.factors**2, 1) + remainder.white
    constant = constant + np.sum((basis.vectors @ emulator.noise) * basis.vectors, 1)
    sd = np.sqrt(variance @ basis.vectors.T**2 + _spread(emulator, u)[:, None] * constant)
    return _outputs(basis, mean.T), basis.scale * sd


def predictive_draws(rng: np.random.Generator, emulator: Emulator, u: np.ndarray) -> np.ndarray:
    """A new simulated output, run-to-run noise included, for each row of u [n, d]: [n, m]."""
    basis, remainder = emulator.basis, emulator.remainder
    mean, variance = (part.T for part in predict_scores(emulator.gp, u))
    full = np.any(basis.vectors, 0)
    latent, noisy = rng.normal(size=mean.shape), rng.normal(size=mean.shape)
    factor = rng.normal(size=(len(u), remainder.factors.shape[1]))
    white = rng.normal(size=(len(u), len(basis.scale)))
    values, vectors = np.linalg.eigh(emulator.noise)
    noisy = noisy @ (vectors * np.sqrt(np.maximum(values, 0.0))).T * full
    size = np.sqrt(_spread(emulator, u))[:, None]
    scores = (mean + np.sqrt(variance) * latent) * full + size * noisy
    left = factor @ remainder.factors.T + np.sqrt(remainder.white) * white
    return basis.centre + basis.scale * (scores @ basis.vectors.T + size * left)


def latent_covariance(emulator: Emulator, u: np.ndarray) -> np.ndarray:
    """Of the emulator's own error in the mean output at u [d]: [m, m], run-to-run noise apart."""
    basis = emulator.basis
    variance = predict_scores(emulator.gp, u[None])[1][:, 0]
    standard = (basis.vectors * variance) @ basis.vectors.T
    return standard * np.outer(basis.scale, basis.scale)
