"""What other methods make of the same data sets: do they detect a missing effect, and name it?

    python tests/benchmarks/misfit/others.py misfit_sets --out others.jsonl

They get more than criticism does: the simulator's expectation as often as they want it, and the
true covariance of the data. None of them but the comparisons by prediction can name an effect.

- mmd: the maximum mean discrepancy of the data from draws of the prior predictive (Schmitt et al.
  2021), as sbi's `calc_misspecification_mmd` defines it in the space of the data.
- density: the density of the data under the prior predictive, among those of further draws, as
  sbi's `calc_misspecification_logprob`; probabilistic principal components stand for its flow.
- discrepancy: a Gaussian process between simulator and data (Kennedy and O'Hagan 2001); detected
  where it is more probable than .95, at even odds.
- leave-one-out: among the base model and each with one effect, the best log density of each value
  given all others; no test.
- held-out: the best log density of the held-out data given the fitted ones; no test.

In the last three the posterior is Laplace's, in normal scores of the priors.
"""

import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.special import logsumexp, ndtr
from scipy.stats import multivariate_normal

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from bolfi_liquids.inference.criticism.experiment import extended
from data_sets import DataSet
from every_set import main
from subject import Subject, Trial
from subjects import SUBJECTS

PREDICTIVE = 600  # draws of the prior predictive
COMPONENTS = 20
LEVEL = 0.05
AMPLITUDES = 2.0 ** np.arange(-2.0, 5.0)  # of a discrepancy, in sd of the data's noise
LENGTHS = (2.0, 5.0, 12.0, 30.0, 80.0)  # of a discrepancy, in samples
FAR = 3.5  # normal scores of a prior, beyond which nothing is looked for
STEP = 1e-2  # of normal scores, for slopes
STARTS = 64

# Tests against the prior predictive.


@cache
def predictive(name: str) -> np.ndarray:
    """Data of the base model at draws of its prior [n, m]."""
    subject, rng = SUBJECTS[name], np.random.default_rng(0)
    u = rng.uniform(size=(PREDICTIVE, len(subject.prior)))
    columns = subject.prior.from_unit(u)
    thetas = [{key: float(v[k]) for key, v in columns.items()} for k in range(PREDICTIVE)]
    return np.stack([subject.fitted.observe(one, k).ravel() for k, one in enumerate(thetas)])


@cache
def _distances(name: str) -> np.ndarray:
    """Squared distances between draws of the prior predictive [n, n]."""
    return _squared(predictive(name), predictive(name))


def _squared(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    rows = np.sum(one**2, 1)[:, None] + np.sum(other**2, 1) - 2.0 * one @ other.T
    return np.maximum(rows, 0.0)


def _mmd(to: np.ndarray, between: np.ndarray) -> float:
    """Squared discrepancy of one point from n others; the bandwidth is the median distance.

    Args:
        to: Squared distances of the point [n].
        between: Those of the others [n, n].
    """
    width = 2.0 * np.median(np.sqrt(to)) ** 2
    return 1.0 + np.mean(np.exp(-between / width)) - 2.0 * np.mean(np.exp(-to / width))


@cache
def _usual_mmd(name: str) -> np.ndarray:
    """Of each draw from the others [n / 2]."""
    between = _distances(name)
    kept = ~np.eye(PREDICTIVE, dtype=bool)
    return np.array(
        [_mmd(between[k][kept[k]], between[kept[k]][:, kept[k]]) for k in range(PREDICTIVE // 2)]
    )


def mmd(one: DataSet) -> float:
    """p-value."""
    to = _squared(one.observed.reshape(1, -1), predictive(one.subject))[0]
    usual = _usual_mmd(one.subject)
    return float(np.mean(usual >= _mmd(to, _distances(one.subject))))


class Components(NamedTuple):
    """Probabilistic principal components (Tipping and Bishop 1999)."""

    mean: np.ndarray
    directions: np.ndarray  # [m, k]
    variances: np.ndarray  # [k]
    rest: float

    def log_density(self, rows: np.ndarray) -> np.ndarray:
        """But for a constant, of rows [n, m]."""
        left = rows - self.mean
        scores = left @ self.directions
        beyond = np.sum(left**2, 1) - np.sum(scores**2, 1)
        return -0.5 * (np.sum(scores**2 / self.variances, 1) + beyond / self.rest)


@cache
def _components(name: str) -> tuple[Components, np.ndarray]:
    """Learned from half of the draws, and the log densities of the others."""
    taught, others = np.split(predictive(name), 2)
    left = taught - taught.mean(0)
    _, size, rows = np.linalg.svd(left, full_matrices=False)
    variances = size**2 / len(taught)
    rest = variances[COMPONENTS:].sum() / (left.shape[1] - COMPONENTS)
    found = Components(taught.mean(0), rows[:COMPONENTS].T, variances[:COMPONENTS], rest)
    return found, found.log_density(others)


def density(one: DataSet) -> float:
    """p-value."""
    found, usual = _components(one.subject)
    return float(np.mean(usual <= found.log_density(one.observed.reshape(1, -1))))


# Models that are fitted.


class Fitted(NamedTuple):
    """The most probable normal scores z [d], and the data's linear law there.

    Attributes:
        z, covariance: Laplace's posterior.
        mean, slopes: Of the fitted data [m], [m, d], at z.
    """

    z: np.ndarray
    covariance: np.ndarray
    mean: np.ndarray
    slopes: np.ndarray

    def marginal(self, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of the data under the prior of z, by the linear law."""
        return self.mean - self.slopes @ self.z, noise + self.slopes @ self.slopes.T


def expected(subject: Subject, trial: Trial, names: tuple[str, ...], z: np.ndarray) -> np.ndarray:
    """Expected data [n, m] at normal scores [n, d]."""
    prior = extended(subject.prior, subject.extensions, names)
    return trial.expected(prior.from_unit(ndtr(z))).reshape(len(z), -1)


def linear(
    subject: Subject, trial: Trial, names: tuple[str, ...], z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Expected data [m] and their slopes [m, d]."""
    rows = expected(subject, trial, names, np.vstack([z, z + STEP * np.eye(len(z))]))
    return rows[0], ((rows[1:] - rows[0]) / STEP).T


def fit(
    subject: Subject,
    names: tuple[str, ...],
    data: np.ndarray,
    noise: np.ndarray,
    starts: np.ndarray,
) -> Fitted:
    """The most probable parameters and Laplace's posterior, from the best of starts [n, d]."""
    white = np.linalg.inv(np.linalg.cholesky(noise))

    def left(z: np.ndarray) -> np.ndarray:
        rows = (expected(subject, subject.fitted, names, z) - data) @ white.T
        return np.concatenate([rows, z], axis=1)

    def slopes(z: np.ndarray) -> np.ndarray:
        return np.vstack([white @ linear(subject, subject.fitted, names, z)[1], np.eye(len(z))])

    best = starts[np.argmin(np.sum(left(starts) ** 2, 1))]
    found = least_squares(
        lambda z: left(z[None])[0],
        np.clip(best, 0.01 - FAR, FAR - 0.01),
        slopes,
        bounds=(-FAR, FAR),
        ftol=1e-4,
        max_nfev=40,
    )
    mean, rise = linear(subject, subject.fitted, names, found.x)
    information = np.eye(len(found.x)) + (white @ rise).T @ (white @ rise)
    return Fitted(found.x, np.linalg.inv(information), mean, rise)


def models(one: DataSet) -> tuple[dict[str, Fitted], np.ndarray]:
    """The base model ("none") and each with one effect; and the covariance of the data's noise."""
    subject, data = SUBJECTS[one.subject], one.observed.ravel()
    d, rng = len(subject.prior), np.random.default_rng(one.seed)
    noise = subject.fitted.covariance(one.theta)
    base = fit(subject, (), data, noise, 1.2 * rng.normal(size=(STARTS, d)))
    found = {"none": base}
    for name in subject.extensions:
        sizes = np.array([-2.0, -1.0, -0.3, 0.0, 0.3, 1.0, 2.0])
        starts = np.column_stack([np.tile(base.z, (len(sizes), 1)), sizes])
        found[name] = fit(subject, (name,), data, noise, starts)
    return found, noise


def discrepancy(one: DataSet, base: Fitted, noise: np.ndarray) -> float:
    """Probability of one, at even odds."""
    mean, plain = base.marginal(noise)
    left = one.observed.ravel() - mean
    samples = np.arange(len(one.observed))
    apart = np.subtract.outer(samples, samples)
    channels = np.eye(one.observed[0].size)
    sd = np.sqrt(np.trace(noise) / len(noise))

    def log_density(amplitude: float, length: float) -> float:
        process = np.kron(np.exp(-0.5 * (apart / length) ** 2), channels)
        covariance = plain + (amplitude * sd) ** 2 * process
        return float(multivariate_normal.logpdf(left, cov=covariance, allow_singular=True))

    beside = [log_density(a, length) for a in AMPLITUDES for length in LENGTHS]
    gain = logsumexp(beside) - np.log(len(beside)) - log_density(0.0, 1.0)
    return float(1.0 / (1.0 + np.exp(-np.clip(gain, -500.0, 500.0))))


def leave_one_out(data: np.ndarray, fitted: Fitted, noise: np.ndarray) -> float:
    """Log density of each value given all others (Sundararajan and Keerthi 2001)."""
    mean, covariance = fitted.marginal(noise)
    precision = np.linalg.inv(covariance)
    variance = 1.0 / np.diag(precision)
    left = (precision @ (data - mean)) * variance
    return float(-0.5 * np.sum(left**2 / variance + np.log(2.0 * np.pi * variance)))


def predicted(one: DataSet, name: str, fitted: Fitted, noise: np.ndarray) -> float:
    """Log density of the held-out data given the fitted ones; their noise is given [m, m]."""
    subject = SUBJECTS[one.subject]
    names = () if name == "none" else (name,)
    mean, rise = linear(subject, subject.held_out, names, fitted.z)
    covariance = noise + rise @ fitted.covariance @ rise.T
    return float(multivariate_normal.logpdf(one.held_out.ravel(), mean, covariance))


def examine(one: DataSet) -> dict:
    """What each method says: whether it detects, and what it names."""
    found, noise = models(one)
    elsewhere = SUBJECTS[one.subject].held_out.covariance(one.theta)
    loo = {name: leave_one_out(one.observed.ravel(), fit, noise) for name, fit in found.items()}
    held = {name: predicted(one, name, fit, elsewhere) for name, fit in found.items()}
    process = discrepancy(one, found["none"], noise)
    winners = {"leave-one-out": max(loo, key=loo.get), "held-out": max(held, key=held.get)}
    detects = {
        "mmd": mmd(one) < LEVEL,
        "density": density(one) < LEVEL,
        "discrepancy": process > 1.0 - LEVEL,
        **{method: name != "none" for method, name in winners.items()},
    }
    return {
        "subject": one.subject,
        "number": one.number,
        "effects": list(one.effects),
        "truth": one.truth,
        "visible": one.visible,
        "snr": one.snr,
        "detects": {method: bool(yes) for method, yes in detects.items()},
        "names": {method: name for method, name in winners.items() if name != "none"},
    }


if __name__ == "__main__":
    main(examine, __doc__, "others.jsonl")
