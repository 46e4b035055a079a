"""The camera of a movie: from metres in a scene to pixels of a picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class OrthographicView:
    """An orthographic camera: it looks from infinitely far, so lengths keep their ratio.

    Attributes:
        width, height: Of the picture [pixels].
        scale: Pixels per metre.
        centre: What is in the middle of the picture [m], of three coordinates.
        azimuth: Of the camera about z [rad]; at 0 it looks along +y, with x to the right.
        elevation: From which it looks down [rad].
    """

    width: int
    height: int
    scale: float
    centre: tuple[float, float, float]
    azimuth: float
    elevation: float

    @property
    def axes(self) -> NDArray[np.float64]:
        """Unit vectors to the picture's right, up in it, and towards the camera: rows of [3, 3]."""
        (s, c), (t, d) = (
            (np.sin(angle), np.cos(angle)) for angle in (self.azimuth, self.elevation)
        )
        return np.array([[c, s, 0.0], [-s * t, c * t, d], [s * d, -c * d, t]])

    def camera(self, points: NDArray) -> NDArray[np.float64]:
        """How far right, up and towards the camera of the centre points [..., 3] are [m]."""
        return (np.asarray(points, np.float64) - self.centre) @ self.axes.T

    def world(self, points: NDArray) -> NDArray[np.float64]:
        """The inverse of `camera`."""
        return np.asarray(points, np.float64) @ self.axes + self.centre

    def pixels(self, points: NDArray) -> NDArray[np.float64]:
        """Column and row of points [..., 3] of the scene, shape [..., 2]; (0, 0) is the centre of
        the picture's first pixel, and rows count downwards."""
        right, up, _ = np.moveaxis(self.camera(points), -1, 0)
        middle = (self.width - 1) / 2.0, (self.height - 1) / 2.0
        return np.stack([middle[0] + self.scale * right, middle[1] - self.scale * up], axis=-1)

    def metres(self) -> tuple[NDArray, NDArray]:
        """How far right [width] and up [height, 1] of the centre each pixel is [m]."""
        right = (np.arange(self.width) - (self.width - 1) / 2.0) / self.scale
        up = ((self.height - 1) / 2.0 - np.arange(self.height)) / self.scale
        return right, up[:, None]


def window(view: OrthographicView, places: NDArray, margin: float) -> tuple[slice, slice]:
    """Rows and columns of the picture around places [n, 2], columns and rows as `pixels` gives."""
    reach = int(np.ceil(margin)) + 1
    low = np.clip(np.floor(places.min(axis=0)).astype(int) - reach, 0, (view.width, view.height))
    high = np.clip(
        np.ceil(places.max(axis=0)).astype(int) + reach + 1, low, (view.width, view.height)
    )
    return slice(low[1], high[1]), slice(low[0], high[0])
