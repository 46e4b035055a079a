"""A surrogate of one's own: each value of the output is a quadratic function of the parameters.

Give it to `inference.fit(..., surrogate=QuadraticSurface(noise=0.1))`, and check one of your own by
`pytest tests/extensions --family your_module:YourFamily`.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from bolfi_liquids.inference.surrogates import Family, Surrogate, TrainingData

RIDGE = 1e-6  # prior precision of the coefficients


def terms(u: Any) -> Any:
    """1, x_j and x_i x_j at x = 2u - 1: u [n, d] -> [n, p], for arrays of NumPy and JAX."""
    xp = u.__array_namespace__()
    x = 2.0 * u - 1.0
    rows, columns = np.triu_indices(u.shape[1])
    return xp.concat([xp.ones((len(x), 1)), x, x[:, rows] * x[:, columns]], axis=1)


class QuadraticLikelihood(NamedTuple):
    """Independent normal errors of one sd."""

    observed: np.ndarray  # [m]
    coefficients: np.ndarray  # [p, m]
    inverse: np.ndarray  # [p, p], of terms^T terms
    noise: np.ndarray  # [], sd of the data
    scatter: np.ndarray  # [], sd by which runs miss the surface

    def __call__(self, u: Any) -> Any:
        """[n] at u [n, d]; where the surface is not known, its variance counts as noise."""
        xp, at = u.__array_namespace__(), terms(u)
        variance = self.noise**2 + self.scatter**2 * (1.0 + xp.sum((at @ self.inverse) * at, 1))
        square = xp.sum((self.observed - at @ self.coefficients) ** 2, 1)
        return -0.5 * square / variance - 0.5 * len(self.observed) * xp.log(variance)


@dataclass(frozen=True, eq=False)
class QuadraticSurrogate(Surrogate):
    u: np.ndarray  # [n, d]
    log_likelihood: QuadraticLikelihood

    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        known = self.log_likelihood
        at = terms(u)
        sd = known.scatter * np.sqrt(1.0 + np.sum((at @ known.inverse) * at, 1))
        mean = at @ known.coefficients
        return mean, np.broadcast_to(sd[:, None], mean.shape)

    def fantasize(self, u: np.ndarray) -> "QuadraticSurrogate":
        everywhere = np.concatenate([self.u, u])
        inverse = precision(everywhere)
        return replace(
            self, u=everywhere, log_likelihood=self.log_likelihood._replace(inverse=inverse)
        )

    def best(self) -> np.ndarray:
        screen = np.random.default_rng(0).random((4096, self.u.shape[1]))
        return screen[np.argmax(self.log_likelihood(screen))]


def precision(u: np.ndarray) -> np.ndarray:
    """Inverse of the normal equations' matrix [p, p]."""
    at = terms(u)
    return np.linalg.inv(at.T @ at + RIDGE * np.eye(at.shape[1]))


@dataclass(frozen=True)
class QuadraticSurface(Family):
    """Least squares.

    Attributes:
        noise: Sd of the data.
    """

    noise: float = 0.1

    def learn(self, data: TrainingData, key: np.ndarray) -> QuadraticSurrogate:
        at, inverse = terms(data.u), precision(data.u)
        coefficients = inverse @ at.T @ data.features
        left = data.features - at @ coefficients
        freedom = max(left.size - coefficients.size, 1)
        scatter, noise = np.sqrt(np.sum(left**2) / freedom) + 1e-9, np.asarray(self.noise)
        observed = data.observed.ravel()
        likelihood = QuadraticLikelihood(observed, coefficients, inverse, noise, scatter)
        return QuadraticSurrogate(data.u, likelihood)
