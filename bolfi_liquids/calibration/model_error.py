"""The simulator's own error, for which the posterior of a calibration allows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..models import stirring_error
from ..simulators import StirSimulator
from .baseline import Clean, usual_for
from .noise import sensor_noise
from .stirs import frame_interval

if TYPE_CHECKING:
    from ..inference.criticism import SumOfNoises, UsualResidual

SHORT_PART = 0.5
"""Size of the part of the error that is forgotten soon, over that of the other."""

SHORT_TIME = 0.1
"""Time over which it is forgotten [s]."""


@dataclass(frozen=True, eq=False)
class ModelError:
    """The simulator's error on a run's recordings.

    It is that of one viscosity, the best one beside the largest error.

    Attributes:
        usual: The error, as a process over time.
        clean: Names of the recordings from which it was learned; none where it is what is known
            of the simulator.
    """

    usual: "UsualResidual"
    clean: tuple[str, ...] = ()

    @property
    def rms(self) -> float:
        """Of the inclination [rad]."""
        return float(np.sqrt(self.usual.autocovariance[0]))


def model_error(
    stirring: StirSimulator, viscosity: float, clean: Sequence[Clean] = ()
) -> ModelError:
    """The error in a liquid of so many Pa s, learned from clean recordings where there are any.

    Without them it has two parts. One, of size `models.stirring_error`, is correlated as the
    recorded inclination is: in the reference's oil the simulated stick swings as if the viscosity
    were 8 % larger, which an error with a correlation of tenths of seconds would not explain. The
    other is half as large and forgotten within tenths of seconds, as most of the error in cream
    is: whatever does not swing like the stick would count as free of errors.
    """
    from ..inference.criticism import model_error, rhythm

    learned = usual_for(stirring, clean, viscosity)
    if learned is not None:
        return ModelError(learned, tuple(one.recording.path.name for one in clean))
    swings = rhythm(stirring.observed)
    lags = frame_interval(stirring.recordings[0]) * np.arange(len(swings))
    share = SHORT_PART**2
    correlation = (swings + share * np.exp(-lags / SHORT_TIME)) / (1.0 + share)
    return ModelError(model_error(stirring_error(viscosity) * np.sqrt(1.0 + share), correlation))


def noise_beside(stirring: StirSimulator, error: ModelError) -> "SumOfNoises":
    """The cameras' noise and the simulator's error."""
    from ..inference.criticism import KnownNoise, SumOfNoises

    return SumOfNoises((KnownNoise(sensor_noise(stirring.observed)), error.usual))
