"""What goes wrong in a rendered picture: a hand or a hose in the way, glare."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from bolfi_liquids.hardware.cameras import Frame, RenderedCamera
from bolfi_liquids.hardware.rendering.drawing import (
    PixelWindow,
    Stage,
    develop,
    draw,
    window_around,
)
from bolfi_liquids.hardware.rendering.world import WorldState

FRAMES_PER_FAULT = 3  # what gets in the way stays for a tenth of a second


def stick_area(stage: Stage) -> PixelWindow:
    """Where the stick may be."""
    reach = stage.scene.cup_radius * 1.2
    corners = [[x, y, z] for x in (-reach, reach) for y in (-reach, reach) for z in (0.03, 0.26)]
    return window_around(stage.camera.project(np.array(corners)), stage.camera.size)


def render_with(
    fault: "Fault | None",
    stage: Stage,
    exposures: Sequence[WorldState],
    rng: np.random.Generator,
) -> np.ndarray:
    """A picture as `render` makes it, with a fault in it where there is one."""
    image = draw(stage, exposures)
    if fault is not None:
        draw_fault(image, fault)
    return develop(stage, image, rng)


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


def fault_of(index: int, share: float, stage: Stage, seed: int) -> Fault | None:
    """The fault in frame `index`, None for most; the same seed gives the same faults.

    Args:
        index: Of the frame.
        share: Of frames with a fault.
        stage: Faults are centred where its stick may be.
        seed: Of this camera.
    """
    rng = np.random.default_rng((seed, index // FRAMES_PER_FAULT))
    if rng.random() >= share:
        return None
    kind = ("hand", "hose", "glare")[rng.integers(3)]
    low, high = {"hand": (25.0, 70.0), "hose": (6.0, 24.0), "glare": (10.0, 50.0)}[kind]
    area = stick_area(stage)
    return Fault(
        kind,
        (rng.uniform(area.left, area.right), rng.uniform(area.top, area.bottom)),
        rng.uniform(low, high),
        rng.uniform(-np.pi / 2, np.pi / 2),
        rng.uniform(20.0, 170.0),
    )


class FaultyCamera(RenderedCamera):
    """A rendered camera with faults in a share `SHARE` of its frames."""

    SHARE = 0.05

    def read(self) -> Frame | None:
        frame = super().read()
        assert frame is not None
        fault = fault_of(frame.index, self.SHARE, self._stage, self._timing.seed)
        if fault is not None:
            draw_fault(frame.image, fault)
        return frame


def draw_fault(image: np.ndarray, fault: Fault) -> None:
    """Draw a fault into a picture, in place."""
    if fault.kind == "glare":
        _draw_glare(image, fault)
        return
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
