"""What goes wrong in a picture: a hand or a hose in the way, glare, noise."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..vision.opencv import opencv
from .coverage import PixelWindow

FRAMES_PER_FAULT = 3  # what gets in the way stays for a tenth of a second


class Fault(NamedTuple):
    """Something in the picture that does not belong there.

    Attributes:
        kind: "hand", "hose" or "glare".
        place: Where [px].
        size: Half-width of a hand, width of a hose, radius of glare [px].
        angle: Of a hand or hose from the picture's horizontal [rad].
        grey: Of a hand or hose.
    """

    kind: str
    place: tuple[float, float]
    size: float
    angle: float
    grey: float


def fault_of(index: int, share: float, area: PixelWindow, seed: int) -> Fault | None:
    """The fault in frame `index`, None for most; the same seed gives the same faults.

    Args:
        index: Of the frame.
        share: Of frames with a fault.
        area: Where the stick may be; faults are centred there.
        seed: Of this camera.
    """
    rng = np.random.default_rng((seed, index // FRAMES_PER_FAULT))
    if rng.random() >= share:
        return None
    kind = ("hand", "hose", "glare")[rng.integers(3)]
    low, high = {"hand": (25.0, 70.0), "hose": (6.0, 24.0), "glare": (10.0, 50.0)}[kind]
    return Fault(
        kind,
        (rng.uniform(area.left, area.right), rng.uniform(area.top, area.bottom)),
        rng.uniform(low, high),
        rng.uniform(-np.pi / 2, np.pi / 2),
        rng.uniform(20.0, 170.0),
    )


def draw_fault(image: np.ndarray, fault: Fault) -> None:
    """Draw a fault into a picture, in place."""
    if fault.kind == "glare":
        _draw_glare(image, fault)
        return
    cv2 = opencv()
    along = np.array([np.cos(fault.angle), np.sin(fault.angle)])
    place = np.array(fault.place)
    far = float(sum(image.shape))
    # a hand ends in the picture, a hose crosses all of it
    start = place if fault.kind == "hand" else place - far * along
    half = fault.size if fault.kind == "hand" else fault.size / 2.0
    ends = [tuple(int(x) for x in np.rint(end)) for end in (start, place + far * along)]
    cv2.line(image, *ends, int(fault.grey), max(int(2 * half), 1), cv2.LINE_AA)


def _draw_glare(image: np.ndarray, fault: Fault) -> None:
    reach = 2.2 * fault.size
    height, width = image.shape
    left, right = np.clip([fault.place[0] - reach, fault.place[0] + reach], 0, width).astype(int)
    top, bottom = np.clip([fault.place[1] - reach, fault.place[1] + reach], 0, height).astype(int)
    x = np.arange(left, right, dtype=np.float32) - np.float32(fault.place[0])
    y = np.arange(top, bottom, dtype=np.float32) - np.float32(fault.place[1])
    light = 600.0 * np.exp(-np.add.outer(y * y, x * x) * np.float32(1.0 / fault.size**2))
    part = image[top:bottom, left:right]
    part[...] = np.minimum(part + light, 255.0).astype(np.uint8)


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
