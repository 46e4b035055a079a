"""Noise of a camera's picture."""

from dataclasses import dataclass

import numpy as np

from ..vision.opencv import opencv


@dataclass(frozen=True, eq=False)
class PixelNoise:
    """Read and shot noise from a pool of normal numbers, cut out at a random place each time.

    Attributes:
        pool: Standard normal, float32, larger than the picture.
        strength: Standard deviation at each grey level, float32, shape (256,).
    """

    pool: np.ndarray
    strength: np.ndarray

    def add(self, image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """A noisy copy of a picture."""
        cv2 = opencv()
        height, width = image.shape
        top = int(rng.integers(self.pool.shape[0] - height + 1))
        left = int(rng.integers(self.pool.shape[1] - width + 1))
        field = self.pool[top : top + height, left : left + width]
        noisy = cv2.multiply(cv2.LUT(image, self.strength), field)
        return cv2.add(image, noisy, dtype=cv2.CV_8U)


def noise_pool(size: tuple[int, int], read: float, shot: float, seed: int) -> PixelNoise:
    """Prepare noise for pictures of `size` (width, height).

    Args:
        size: Of the pictures [px].
        read: Standard deviation at grey level 0.
        shot: Variance per grey level.
        seed: Of the pool.
    """
    rng = np.random.default_rng(seed)
    pool = rng.standard_normal((size[1] + 397, size[0] + 499), dtype=np.float32)
    return PixelNoise(pool, np.sqrt(read**2 + shot * np.arange(256)).astype(np.float32))
