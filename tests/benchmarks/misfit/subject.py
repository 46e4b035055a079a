"""A simulator that may lack effects, as every study of criticism asks for it.

The signal-to-noise ratio (SNR) of what is hidden is the whitened distance, by the true covariance,
of the expected data from the nearest data that the model reaches without it: with any base
parameters, and with any other effect of the registry in its place.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.experiment import extended
from scipy.optimize import least_squares

from bolfi_liquids import inference

Columns = Mapping[str, np.ndarray]
"""Base parameters and coefficients, name -> [b]; a coefficient that is not there is 0."""

REACH = 1e-3  # quantile of a prior from its end, up to which a rival may go
STEP = 1e-3  # of prior quantiles, for slopes
FITTED_RIVALS = 3  # nearest by their tangents
LARGEST = 0.99  # quantile of a coefficient's prior: what is stronger is not looked for
BLATANT = 60.0  # SNR beyond the base parameters, above which nothing is hidden
SIZES = 15  # that are tried
TINY = 1e-12
LANE = 16  # runs that are simulated together, so that JAX compiles once


class Trial(Protocol):
    """One experiment of a subject, of signals of one shape with m values."""

    def simulate(self, theta: Columns, seeds: np.ndarray) -> np.ndarray:
        """Signals [b, *shape], each with the error of its seed: what `inference` calls."""
        ...

    def expected(self, theta: Columns) -> np.ndarray:
        """Without that error [b, *shape]."""
        ...

    def observe(self, theta: Mapping[str, float], seed: int) -> np.ndarray:
        """Data of one more experiment, its noise included [*shape]."""
        ...

    def covariance(self, theta: Mapping[str, float]) -> np.ndarray:
        """Of the data about their expectation [m, m]."""
        ...


@dataclass(frozen=True)
class Subject:
    """A simulator, what it may lack, and two experiments.

    Attributes:
        name: Of its files.
        prior: Of the base parameters.
        extensions: The registry: what the simulator may lack, and is known.
        outside: What it may lack, and the registry does not hold.
        fitted, held_out: The experiments.
        noise: What is known of the noise of the first of several data sets.
        settings: Of both experiments, for a person.
    """

    name: str
    prior: inference.Prior
    extensions: Mapping[str, criticism.Extension]
    outside: Mapping[str, criticism.Extension]
    fitted: Trial
    held_out: Trial
    noise: Callable[[list[np.ndarray]], criticism.Noise]
    settings: str

    @property
    def effects(self) -> dict[str, criticism.Extension]:
        """Those inside and outside of the registry."""
        return {**self.extensions, **self.outside}


def in_lanes(solve: Callable, names: tuple[str, ...], theta: Columns) -> np.ndarray:
    """Call `solve` with values [16, names] until all of theta is done; a name without one is 0."""
    n = len(next(iter(theta.values())))
    values = np.zeros((-(-n // LANE) * LANE, len(names)), np.float32)
    for name, column in theta.items():
        values[:n, names.index(name)] = column
    values[n:] = values[0]
    found = [np.asarray(solve(lane)) for lane in np.split(values, len(values) // LANE)]
    return np.concatenate(found)[:n].astype(float)


def alone(theta: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Columns of one run."""
    return {name: np.array([value]) for name, value in theta.items()}


def whitener(trial: Trial, theta: Mapping[str, float]) -> np.ndarray:
    """Inverse of the lower Cholesky factor of the covariance [m, m]."""
    return np.linalg.inv(np.linalg.cholesky(trial.covariance(theta)))


def distance(
    subject: Subject, names: tuple[str, ...], theta: Mapping[str, float], white: np.ndarray
) -> float:
    """Least whitened distance of what is expected at theta from what the model with the named
    effects reaches within its prior, in the fitted experiment."""
    prior = extended(subject.prior, subject.extensions, names)
    target = white @ subject.fitted.expected(alone(theta)).ravel()

    def reached(u: np.ndarray) -> np.ndarray:
        found = subject.fitted.expected(prior.from_unit(u))
        return found.reshape(len(u), -1) @ white.T

    def slopes(u: np.ndarray) -> np.ndarray:
        step = np.where(u < 0.5, STEP, -STEP)
        rows = reached(np.vstack([u, u + np.diag(step)]))
        return ((rows[1:] - rows[0]) / step[:, None]).T

    start = {name: np.asarray(theta.get(name, 0.0)) for name in prior.names}
    u = np.clip(prior.to_unit(start).reshape(len(prior)), 2.0 * REACH, 1.0 - 2.0 * REACH)
    found = least_squares(
        lambda u: reached(u[None])[0] - target,
        u,
        slopes,
        bounds=(REACH, 1.0 - REACH),
        ftol=1e-3,
        xtol=1e-5,
        max_nfev=40,
    )
    return float(np.sqrt(2.0 * found.cost))


def signal_to_noise(
    subject: Subject, hidden: tuple[str, ...], theta: Mapping[str, float], white: np.ndarray
) -> tuple[float, float]:
    """SNR of hidden effects at theta: beyond the base parameters, and beyond all rivals as well.

    A rival has one of the effects replaced by another of the registry; those of what is outside of
    it are all single effects. Only the nearest by their tangents are fitted.
    """
    known = tuple(name for name in hidden if name in subject.extensions)
    others = [name for name in subject.extensions if name not in known]
    kept = [tuple(k for k in known if k != one) for one in known] if known else [()]
    rivals = [(*names, other) for names in kept for other in others]

    def tangential(rival: tuple[str, ...]) -> float:
        without = {name: v for name, v in theta.items() if name not in hidden or name in rival}
        tangents = _tangents(subject, without, (*subject.prior.names, *rival), white)
        return float(np.linalg.norm(_beyond(_changes(subject, without, [theta], white), tangents)))

    visible = distance(subject, (), theta, white)
    near = sorted(rivals, key=tangential)[:FITTED_RIVALS]
    return visible, min([visible, *(distance(subject, one, theta, white) for one in near)])


def size(
    subject: Subject, base: Mapping[str, float], effect: str, ratio: float, white: np.ndarray
) -> float:
    """Coefficient of an effect with this SNR (below 0 on the side of negative coefficients), by
    the tangents of all rivals.

    At most the prior's `LARGEST` quantile, or what is `BLATANT` beyond the base parameters.
    """
    greatest = float(subject.effects[effect].prior.icdf(LARGEST if ratio > 0 else 1.0 - LARGEST))
    tried = greatest * np.geomspace(1e-3, 1.0, SIZES)
    basis = _tangents(subject, base, subject.prior.names, white)
    left = _beyond(_changes(subject, base, [{**base, effect: c} for c in tried], white), basis)
    rivals = [name for name in subject.extensions if name != effect]
    rows = _beyond(_tangents(subject, base, rivals, white), basis)
    rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), TINY)
    visible = np.linalg.norm(left, axis=1)
    snr = np.sqrt(np.maximum(visible**2 - np.max((left @ rows.T) ** 2, axis=1), TINY))
    reached = np.flatnonzero((snr >= abs(ratio)) | (visible >= BLATANT))
    k = reached[0] if len(reached) else SIZES - 1
    if k == 0 or snr[k] < abs(ratio):
        return float(tried[k])
    share = np.log(abs(ratio) / snr[k - 1]) / np.log(snr[k] / snr[k - 1])
    return float(tried[k - 1] * (tried[k] / tried[k - 1]) ** share)


def two_sided(extension: criticism.Extension) -> bool:
    """Whether the coefficient may be negative."""
    return float(extension.prior.icdf(0.01)) < 0.0


def _changes(
    subject: Subject,
    base: Mapping[str, float],
    thetas: Sequence[Mapping[str, float]],
    white: np.ndarray,
) -> np.ndarray:
    """Whitened changes of what is expected, from base to each theta [n, m]."""
    names = dict.fromkeys(name for theta in (base, *thetas) for name in theta)
    columns = {n: np.array([theta.get(n, 0.0) for theta in (base, *thetas)]) for n in names}
    found = subject.fitted.expected(columns).reshape(len(thetas) + 1, -1)
    return (found[1:] - found[0]) @ white.T


def _tangents(
    subject: Subject, theta: Mapping[str, float], names: Sequence[str], white: np.ndarray
) -> np.ndarray:
    """Whitened changes by a small step of each parameter or coefficient [n, m]."""
    priors = subject.prior.distributions | {n: one.prior for n, one in subject.effects.items()}
    steps = {name: float(priors[name].icdf(0.52) - priors[name].icdf(0.5)) for name in names}
    moved = [{**theta, name: theta.get(name, 0.0) + step} for name, step in steps.items()]
    return _changes(subject, theta, moved, white)


def _beyond(changes: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """Changes [n, m] less what tangents [d, m] span of them."""
    basis = np.linalg.qr(tangents.T)[0]
    return changes - changes @ basis @ basis.T
