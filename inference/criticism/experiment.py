"""Data of one experiment, and the simulator that should explain them."""

from dataclasses import dataclass

import numpy as np

from ..arguments import check_function, check_kind, check_text, checked_array, checked_integer
from ..types import Simulator
from .measurement_noise import Noise, check_noise
from .misfit import Window
from .usual_residual import expected_model_error


@dataclass(frozen=True, eq=False)
class Experiment:
    """One experiment; others may share the simulator's parameters, not its settings.

    Attributes:
        simulate: (theta, seeds) -> signals [b, *signal_shape]. theta holds the base parameters
            and those coefficients that are not neutral.
        observed: [*signal_shape], NaN where missing.
        noise: Between the simulator and the data.
        identity: Names the simulator and its settings in the bank.
        label: A name for tables.
        windows: Where to look for disagreement.

    Raises:
        ValueError: `observed` has no finite value, or a window is of another shape.
    """

    simulate: Simulator
    observed: np.ndarray
    noise: Noise
    identity: str = ""
    label: str = "data"
    windows: tuple[Window, ...] = ()

    def __post_init__(self) -> None:
        check_function("simulate", self.simulate)
        observed = checked_array("observed", self.observed)
        if not np.isfinite(observed).any():
            raise ValueError(f"{self.label}: observed must have a finite value, got none")
        check_text("identity", self.identity)
        check_noise(f"{self.label}: noise", self.noise)
        check_kind("windows", self.windows, list | tuple)
        for window in self.windows:
            check_kind("each of windows", window, Window)
            if window.samples.shape != observed.shape:
                raise ValueError(
                    f"{self.label}: the window {dict(window.label)} has the shape "
                    f"{window.samples.shape}, expected {observed.shape} as observed"
                )
        object.__setattr__(self, "observed", observed)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the output."""
        return self.observed.shape

    @property
    def corrected(self) -> np.ndarray:
        """Observed less the simulator's known residual [*signal_shape]."""
        return self.observed - expected_model_error(self.noise, self.observed)


@dataclass(frozen=True)
class Proposal:
    """An experiment that could be made.

    Attributes:
        simulate, noise, identity: As of an `Experiment`.
        shape: Of its output.
        label: What to do, for a person.

    Raises:
        ValueError: a field is of another kind.
    """

    simulate: Simulator
    noise: Noise
    shape: tuple[int, ...]
    identity: str = ""
    label: str = "experiment"

    def __post_init__(self) -> None:
        check_function("simulate", self.simulate)
        check_noise(f"{self.label}: noise", self.noise)
        check_kind("shape", self.shape, tuple)
        for length in self.shape:
            checked_integer("each of shape", length)
