"""The one rule for a camera's stamps: each follows the one before it by less than half a second."""

import numpy as np
from numpy.typing import NDArray

MAX_STEP = 0.5  # [s] between two pictures; no camera is as slow


def stamp_fault(step: float, index: int, after: float) -> str:
    """What is wrong with a picture's stamp, and the cure; empty where nothing is.

    Args:
        step: Its stamp less the one before it [s].
        index: Of the picture.
        after: From the camera's first picture to the last good one [s].
    """
    if 0.0 < step < MAX_STEP:
        return ""
    what = f"jump by {step:.2f} s" if step > 0.0 else "stand still or go back"
    return (
        f"its stamps {what} at frame {index} ({after:.1f} s): check its cable and what else this "
        "computer does, or take another camera"
    )


def first_fault(
    index: NDArray[np.float64], stamp: NDArray[np.float64], begin: float
) -> tuple[int, str]:
    """First row whose stamp cannot be used, and why; (N, "") where there is none.

    Args:
        index: Of the pictures, shape (N,).
        stamp: On this computer's clock [s], shape (N,).
        begin: Of the stir [s]; pictures may be lost before it.
    """
    step = np.diff(stamp)
    usable = (step > 0.0) & ((step < MAX_STEP) | (stamp[1:] < begin))
    if usable.all():
        return len(stamp), ""
    row = 1 + int(np.argmin(usable))
    after = float(stamp[row - 1] - stamp[0])
    return row, stamp_fault(float(step[row - 1]), int(index[row]), after)
