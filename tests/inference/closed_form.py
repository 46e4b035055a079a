"""Simulators whose likelihood is a formula, and posteriors computed from it."""

import functools
from dataclasses import dataclass

import numpy as np
import numpyro.distributions as dist
from scipy.linalg import toeplitz

from bolfi_liquids import inference

STEPS = 30
CELLS = 100  # per axis, for quadrature


@dataclass(frozen=True)
class Gaussian:
    """mean(theta) plus stationary Gaussian noise, AR(1) over STEPS samples.

    `kind` is "line", "decay" or "bimodal"; the noise is part of what is simulated.
    """

    kind: str
    sd: float
    correlation: float = 0.0

    def mean(self, theta):
        """[n, STEPS]."""
        first, second = (np.asarray(column, float)[:, None] for column in theta.values())
        t = np.linspace(0.0, 1.0, STEPS)
        if self.kind == "line":
            return first + second * t
        if self.kind == "decay":
            return first * np.exp(-second * t)
        return first**2 * t + second * (1.0 - t)  # two equal modes in the first

    def __call__(self, theta, seeds):
        noise = np.stack([np.random.default_rng(seed).normal(size=STEPS) for seed in seeds])
        return self.mean(theta) + noise @ roots(self.sd, self.correlation)[0].T

    def log_likelihood(self, theta, observed):
        """[n], up to a constant."""
        white = (observed - self.mean(theta)) @ roots(self.sd, self.correlation)[1].T
        return -0.5 * np.sum(white**2, axis=1)


@functools.cache
def roots(sd, correlation):
    """Lower Cholesky factor of the noise covariance, and its inverse."""
    lower = np.linalg.cholesky(sd**2 * toeplitz(correlation ** np.arange(STEPS)))
    return lower, np.linalg.inv(lower)


LINE = Gaussian("line", sd=1.0)
DECAY = Gaussian("decay", sd=0.1, correlation=0.6)
BIMODAL = Gaussian("bimodal", sd=0.15)

LINE_PRIOR = inference.Prior({"offset": dist.Normal(0.0, 1.0), "slope": dist.Normal(0.0, 1.0)})
DECAY_PRIOR = inference.Prior(
    {"amplitude": dist.LogUniform(0.5, 2.0), "rate": dist.LogUniform(0.2, 10.0)}
)
BIMODAL_PRIOR = inference.Prior({"fold": dist.Uniform(-1.0, 1.0), "level": dist.Uniform(0.0, 1.0)})

TASKS = {
    "line": (Gaussian("line", sd=0.3), LINE_PRIOR),
    "decay": (DECAY, DECAY_PRIOR),
    "bimodal": (BIMODAL, BIMODAL_PRIOR),
}


@dataclass(frozen=True)
class LinePosterior:
    """The exact posterior of LINE under LINE_PRIOR, or one with a fault planted.

    Attributes:
        variance: Factor on the likelihood's variance.
        prior: Factor on the prior's precision; 0 ignores the prior.
        data: Factor on the likelihood; 0 ignores the data.
        correlation: Of successive draws, which form stationary AR(1) chains.
        shape: Chains and draws.
    """

    variance: float = 1.0
    prior: float = 1.0
    data: float = 1.0
    correlation: float = 0.0
    shape: tuple[int, int] = (2, 200)

    def __call__(self, observed, seed):
        design = np.stack([np.ones(STEPS), np.linspace(0.0, 1.0, STEPS)], axis=1)
        precision = self.prior * np.eye(2)
        precision += self.data * design.T @ design / (self.variance * LINE.sd**2)
        covariance = np.linalg.inv(precision)
        mean = covariance @ design.T @ observed * self.data / (self.variance * LINE.sd**2)
        white = autoregressive(np.random.default_rng(seed), self.shape, self.correlation)
        draws = mean + white @ np.linalg.cholesky(covariance).T
        return {"offset": draws[..., 0], "slope": draws[..., 1]}, self.log_density(observed)

    def log_density(self, observed):
        def log_density(theta):
            prior = -0.5 * (theta["offset"] ** 2 + theta["slope"] ** 2)
            return prior + LINE.log_likelihood(theta, observed)

        return log_density


def autoregressive(rng, shape, correlation):
    """Stationary standard normal AR(1) chains, [chain, draw, 2]."""
    noise = rng.normal(size=(*shape, 2))
    chain = [noise[:, 0]]
    for step in range(1, shape[1]):
        chain.append(correlation * chain[-1] + np.sqrt(1.0 - correlation**2) * noise[:, step])
    return np.stack(chain, axis=1)


@dataclass(frozen=True)
class GridPosterior:
    """Independent draws from the posterior by quadrature over prior quantiles."""

    simulate: Gaussian
    prior: inference.Prior
    draws: int = 63

    def __call__(self, observed, seed):
        rng = np.random.default_rng(seed)
        u, theta = grid(self.prior)
        log_likelihood = self.simulate.log_likelihood(theta, observed)
        weights = np.exp(log_likelihood - log_likelihood.max())
        chosen = rng.choice(len(u), self.draws, p=weights / weights.sum())
        within = u[chosen] + (rng.random((self.draws, 2)) - 0.5) / CELLS
        return self.prior.from_unit(within)


@functools.cache
def grid(prior):
    """Midpoints of CELLS x CELLS cells as quantiles and as parameters."""
    axis = (np.arange(CELLS) + 0.5) / CELLS
    u = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
    return u, prior.from_unit(u)
