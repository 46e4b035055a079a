"""What the processes of an online calibration are given, and the status that they report."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inputs.prior import Described
from ..inputs.recording import Recording
from .plan import planned
from .settings import OnlineSettings

if TYPE_CHECKING:
    from ..models import Cups

PARTNER_GONE = EOFError, BrokenPipeError, ConnectionResetError
"""What a pipe raises when its other end is closed."""


class OnlinePhase(StrEnum):
    """Phase of an online calibration."""

    PREPARING = "preparing"
    READY = "ready"
    REFUSED = "refused"
    FAILED = "failed"

    @property
    def advice(self) -> str:
        """What it means and what to do next."""
        return _ADVICE[self]


_ADVICE = {
    OnlinePhase.PREPARING: "The design is simulated and the map of landings learned. Let the robot "
    "move after `wait_until_ready`.",
    OnlinePhase.READY: "Hand over the recording so far by `update` after each stroke.",
    OnlinePhase.REFUSED: "The last data cannot be used; `status.detail` says why. Earlier "
    "estimates hold, and later data may be used again.",
    OnlinePhase.FAILED: "No estimate will follow; `status.detail` says why. The recording goes on: "
    "calibrate on it by `finish` afterwards.",
}


class Status(NamedTuple):
    """How an online calibration is doing.

    Attributes:
        phase: What it is doing; `phase.advice` says what to do.
        detail: What is being prepared, or what is wrong; "" if nothing is.
        simulations: Finished, failed ones included.
        in_flight: Being simulated.
    """

    phase: OnlinePhase
    detail: str
    simulations: int = 0
    in_flight: int = 0


@dataclass(frozen=True, eq=False)
class Request:
    """All that the processes need to start; it can be pickled.

    Attributes:
        time, position: The plan's path, [s] (T,) and [m] (T, 3).
        attrs: The plan's attributes.
        cups: Of the pour.
        prior: Of the liquid, as `describe_prior` describes it.
        settings: Of the online calibration.
        bank: File of the simulation bank.
        log: File to which every estimate is appended, as a line of JSON.
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    attrs: Mapping[str, float | str]
    cups: "Cups"
    prior: Mapping[str, Described]
    settings: OnlineSettings
    bank: Path
    log: Path

    def plan(self) -> Recording:
        """The plan as a recording that has seen nothing."""
        return planned(self.time, self.position, self.attrs)
