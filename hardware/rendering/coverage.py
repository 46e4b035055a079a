"""How much of each pixel a shape covers: straight edges and discs, exact to a small fraction."""

from typing import NamedTuple

import numpy as np


class PixelWindow(NamedTuple):
    """A part of the picture: rows and columns from the first to before the last."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def empty(self) -> bool:
        """Whether it holds no pixel."""
        return self.bottom <= self.top or self.right <= self.left


def window_around(points: np.ndarray, size: tuple[int, int], margin: float = 2.0) -> PixelWindow:
    """The part of a picture of `size` (width, height) that holds points [px], shape (N, 2)."""
    if not np.isfinite(points).all():
        return PixelWindow(0, 0, 0, 0)
    left, top = np.floor(points.min(axis=0) - margin)
    right, bottom = np.ceil(points.max(axis=0) + margin) + 1
    width, height = size
    return PixelWindow(
        int(np.clip(top, 0, height)),
        int(np.clip(bottom, 0, height)),
        int(np.clip(left, 0, width)),
        int(np.clip(right, 0, width)),
    )


def bar_coverage(sides: np.ndarray, window: PixelWindow) -> np.ndarray:
    """Covered share of each pixel of a window by a bar, float32.

    Exact for an edge along the pixel's sides, and for other directions of mean error zero, so
    that the middle between two edges is not shifted.

    Args:
        sides: Pixels along its two long sides, both from the same end, shape (2, K, 2); a lens
            that distorts bends them, so K is 2 or, for bent ones, at least 5.
        window: Where to evaluate.
    """
    # towards the other side, not to the bar's middle: a thin bent bar bends past its chord
    across, along = sides[1].mean(axis=0) - sides[0].mean(axis=0), sides[0, -1] - sides[0, 0]
    inside = [_half_plane(sides[0], across, window), _half_plane(sides[1], -across, window)]
    ends = [_half_plane(sides[:, 0], along, window), _half_plane(sides[:, -1], -along, window)]
    return np.maximum(inside[0] + inside[1] - 1.0, 0.0) * ends[0] * ends[1]


def _half_plane(edge: np.ndarray, inwards: np.ndarray, window: PixelWindow) -> np.ndarray:
    """Covered share on the side of an edge, through points of shape (K, 2), that is inwards."""
    columns = np.arange(window.left, window.right)
    rows = np.arange(window.top, window.bottom)
    start, along = edge[0], edge[-1] - edge[0]
    length = max(float(np.hypot(*along)), 1e-9)
    normal = np.array([-along[1], along[0]]) / length
    if normal @ inwards < 0:
        normal = -normal
    distance = _outer_sum(rows * normal[1] + (0.5 - normal @ start), columns * normal[0])
    if len(edge) > 2:
        share = along / length**2
        place = _outer_sum(rows * share[1] - share @ start, columns * share[0])
        # a cubic through the bent edge is right to a hundredth of a pixel
        bend = np.polyfit((edge - start) @ share, (edge - start) @ normal, 3).astype(np.float32)
        distance -= ((bend[0] * place + bend[1]) * place + bend[2]) * place + bend[3]
    return np.clip(distance, 0.0, 1.0, out=distance)


def _outer_sum(down: np.ndarray, across: np.ndarray) -> np.ndarray:
    return np.add.outer(down.astype(np.float32), across.astype(np.float32))


def disc_coverage(centre: np.ndarray, radius: float, window: PixelWindow) -> np.ndarray:
    """Covered share of each pixel of a window by a disc [px], float32."""
    columns = np.arange(window.left, window.right, dtype=np.float32) - np.float32(centre[0])
    rows = np.arange(window.top, window.bottom, dtype=np.float32) - np.float32(centre[1])
    distance = np.hypot(rows[:, None], columns[None, :])
    return np.clip(radius + 0.5 - distance, 0.0, 1.0)


def blend(image: np.ndarray, window: PixelWindow, coverage: np.ndarray, grey: float) -> None:
    """Paint a grey level over a part of the picture, in place."""
    part = image[window.top : window.bottom, window.left : window.right]
    part[...] = np.rint(part + coverage * (np.float32(grey) - part)).astype(np.uint8)
