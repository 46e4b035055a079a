"""Principal components of simulated outputs."""

from typing import NamedTuple

import numpy as np


class Basis(NamedTuple):
    """Output = centre + scale * (vectors @ scores), scores of unit variance.

    Shapes: m values of an output; k components, of which the last `k - used` are empty.
    """

    centre: np.ndarray  # [m]
    scale: np.ndarray  # [m], what makes values of different kind comparable
    vectors: np.ndarray  # [m, k], orthogonal; each as long as its score's sd
    used: int
    explained: float  # share of the variance

    def only(self, kept: np.ndarray) -> "Basis":
        """With the components `kept`, bool [k], in front and all others empty."""
        squared = np.sum(self.vectors**2, 0)
        vectors = np.zeros_like(self.vectors)
        vectors[:, : kept.sum()] = self.vectors[:, kept]
        share = squared[kept].sum() / squared.sum() if squared.any() else 1.0
        return self._replace(
            vectors=vectors, used=int(kept.sum()), explained=self.explained * float(share)
        )

    def standardise(self, outputs: np.ndarray) -> np.ndarray:
        """[n, m] -> [n, m]."""
        return (outputs - self.centre) / self.scale

    def scores(self, outputs: np.ndarray) -> np.ndarray:
        """[n, m] -> [n, k]; 0 for empty components."""
        squared = np.sum(self.vectors**2, 0)
        return self.standardise(outputs) @ self.vectors / np.where(squared > 0, squared, 1.0)

    def residuals(self, outputs: np.ndarray) -> np.ndarray:
        """Standardised outputs less their components, [n, m]."""
        return self.standardise(outputs) - self.scores(outputs) @ self.vectors.T


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
    if spread is not None:  # scores of unit variance over all runs, as the processes' priors mean
        squared = np.sum(vectors**2, 0)
        scores = ((outputs - centre) / scale) @ vectors / np.where(squared > 0.0, squared, 1.0)
        vectors = vectors * np.sqrt(np.mean(scores**2, 0))
    return Basis(centre, scale, vectors, used, explained)
