"""A camera of one's own: it shows a pattern that moves, at the rate of its section of rig.toml.

Beside rig.toml, `driver = "pattern_camera.py:PatternCamera"` in its section of `cameras` opens it.
Check one of your own by `pytest tests/extensions --camera your_module:YourCamera`.
"""

import time

import numpy as np
from bolfi_liquids.hardware.cameras import CameraError, Frame, FrameSource
from bolfi_liquids.hardware.rig import Camera


class PatternCamera(FrameSource):
    """Stripes that wander by a pixel a picture."""

    def __init__(self, camera: Camera):
        self._shape, self._period = (camera.height, camera.width), 1.0 / camera.rate
        self._next, self._index, self._open = time.monotonic(), 0, True

    def read(self) -> Frame:
        if not self._open:
            raise CameraError("the pattern is closed: open it again")
        time.sleep(max(self._next - time.monotonic(), 0.0))
        self._next += self._period
        stripes = 8 * ((np.arange(self._shape[1]) + self._index) % 32)
        image = np.tile(stripes.astype(np.uint8), (self._shape[0], 1))
        self._index += 1
        return Frame(self._index - 1, time.monotonic(), image)

    def close(self) -> None:
        self._open = False
