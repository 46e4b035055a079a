"""Measurement noise that users give: its sd, its sds or its covariance."""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ..._float64 import in_float64
from ...arguments import checked_array
from ..measurement_noise import Layout
from ..output_vectors import Output


@runtime_checkable
class Covariance(Protocol):
    """Noise that knows its covariance [n, n] at n samples, as all of `criticism` do."""

    def covariance(self, at: Layout) -> np.ndarray: ...


class GivenNoise(NamedTuple):
    """Gaussian noise of covariance diag(white) + factors factors^T."""

    white: np.ndarray  # [m]
    factors: np.ndarray  # [m, q]; q is 0 where the noise is independent

    @property
    def variance(self) -> np.ndarray:
        return self.white + np.sum(self.factors**2, 1)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the values [m, m]."""
        return np.diag(self.white) + self.factors @ self.factors.T

    def draw(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """n draws of the noise [n, m]."""
        m, q = self.factors.shape
        return (
            rng.normal(size=(n, m)) * np.sqrt(self.white) + rng.normal(size=(n, q)) @ self.factors.T
        )


def check_noise(noise: ArrayLike | Covariance) -> None:
    """Raise ValueError for what is never a noise; its shape is looked at beside the output's."""
    if not isinstance(noise, Covariance):
        checked_array("noise", noise)


def given_noise(noise: ArrayLike | Covariance, output: Output) -> GivenNoise:
    """The noise of an output's values.

    Args:
        noise: As in `SignalFamily`: sd, sds or covariance of what was observed, or an object that
            has it.
        output: How what was observed becomes m values.

    Raises:
        ValueError: noise is none of these.
    """
    if isinstance(noise, Covariance):
        return _covariance(_at_samples(noise, output), output)
    sds = given_sds(noise, output)
    if sds is None:
        return _covariance(checked_array("noise", noise), output)
    variances = np.full(len(output.present), sds**2)[output.rank]
    return _independent(output.average(variances) / output.counts)


def given_sds(noise: ArrayLike, output: Output) -> np.ndarray | None:
    """Sds of independent noise of the observed values, in the flattened order [n], or one of all
    []; None for a covariance.

    Raises:
        ValueError: noise is none of these.
    """
    samples, given = len(output.present), checked_array("noise", noise)
    square = samples, samples
    if given.ndim < 2 and given.size == 1:
        sds = given.reshape(())
    elif given.shape == square != output.shape:
        return None
    elif given.shape == output.shape != square:
        sds = given.ravel()[np.sort(output.present)]
    elif given.shape == (samples,):
        sds = given
    elif given.shape == square:
        raise ValueError(
            f"noise of shape {given.shape} may be sds or a covariance; give sds as [{samples}]"
        )
    else:
        raise ValueError(
            f"noise must be a number, sds of shape {output.shape} as observed or [{samples}], or a "
            f"[{samples}, {samples}] covariance, of the finite observed values, "
            f"got shape {given.shape}"
        )
    wrong = sds[~(np.isfinite(sds) & (sds >= 0.0))]
    if wrong.size:
        raise ValueError(
            f"noise must be finite and not negative where observed is finite, got {wrong[0]}"
        )
    return sds


def _at_samples(noise: Covariance, output: Output) -> np.ndarray:
    """Covariance of what was observed, in the flattened order."""
    if output.summary is not None:
        raise ValueError("noise of samples is not that of their summary; give noise= as sds of it")
    channels = int(np.prod(output.shape[1:]))
    at = np.sort(output.present)
    return checked_array("noise", noise.covariance(Layout(at % channels, at // channels)))


def _independent(variances: np.ndarray) -> GivenNoise:
    return GivenNoise(variances, np.zeros((len(variances), 0)))


@in_float64
def _covariance(given: np.ndarray, output: Output) -> GivenNoise:
    """White noise and factors of the covariance; the white part keeps it well conditioned."""
    refusal = "noise must be a finite, symmetric, positive semidefinite covariance"
    if not (np.isfinite(given).all() and np.allclose(given, given.T)):
        raise ValueError(refusal)
    averaged = output.average_covariance(given)
    variances = np.diag(averaged).copy()
    if np.array_equal(averaged, np.diag(variances)) and (variances >= 0.0).all():
        return _independent(variances)
    sds = np.sqrt(np.where(variances > 0.0, variances, 1.0))
    values, vectors = np.linalg.eigh(averaged / np.outer(sds, sds))
    if (variances < 0.0).any() or values[0] < -1e-9 * values[-1]:
        raise ValueError(refusal)
    least = 0.9 * max(values[0], 0.0)
    factors = sds[:, None] * vectors * np.sqrt(np.maximum(values - least, 0.0))
    return GivenNoise(least * sds**2, factors)
