"""What an online calibration is asked to do."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from .settings import OnlineSettings

if TYPE_CHECKING:
    from ..inference import Prior
    from ..models import Cups
    from .estimate import OnlineEstimate

USUAL_CYCLES = 5  # of the pattern at the most, by default


class OnlineChoice(NamedTuple):
    """What to calibrate, for which pour, and where.

    Attributes:
        run: The RUN directory to be made.
        cups: Source and receiver of the pour; None takes the bundled ones.
        settings: Target and engine.
        bank: Simulations to reuse and to keep: pours of the same cups and density, and the design
            of the same plan, rig and density. None is a file in `run`.
        prior: Prior of `viscosity` [Pa s] and `cohesion` [1]; None is `default_prior()`.
        cycles: How often the pattern is stirred at the most, by `record_online`.
        told: Called by `record_online` with each estimate.
    """

    run: Path
    cups: "Cups | None" = None
    settings: OnlineSettings = OnlineSettings()
    bank: Path | None = None
    prior: "Prior | None" = None
    cycles: int = USUAL_CYCLES
    told: "Callable[[OnlineEstimate], None] | None" = None
