"""Data of an experiment, the simulator that should explain them, and the effects it may lack."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpyro.distributions as dist

from ..arguments import (
    check_function,
    check_kind,
    check_text,
    checked_array,
    checked_integer,
    checked_number,
)
from ..prior import Prior
from ..types import Simulator
from .measurement_noise import Noise, check_noise, samples
from .model_errors import split_noise
from .verdict_kind import NONE, OTHER


class Window(NamedTuple):
    """Samples that are looked at together.

    Attributes:
        label: What they have in common, for a person and for tables.
        samples: Which of the observed, bool [*signal_shape].
    """

    label: Mapping[str, object]
    samples: np.ndarray


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
        noise_at: The noise at parameters, name -> value, where it depends on them, as that of a
            simulator that errs more in some regimes; a model is judged by that at its own best.

    Raises:
        ValueError: `observed` has no finite value, or a window is of another shape.
    """

    simulate: Simulator
    observed: np.ndarray
    noise: Noise
    identity: str = ""
    label: str = "data"
    windows: tuple[Window, ...] = ()
    noise_at: Callable[[Mapping[str, float]], Noise] | None = None

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

    def check_noise(self) -> None:
        """Raise ValueError unless the noise can be drawn for these data."""
        try:
            self.noise.draw(np.random.default_rng(0), samples(self.observed), 1)
        except (ValueError, IndexError) as err:
            raise ValueError(
                f"{self.label}: the noise does not fit observed of the shape {self.shape} with "
                f"{np.isfinite(self.observed).sum()} finite values ({err}); give one sd, "
                "or one for each of them"
            ) from err

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the output."""
        return self.observed.shape

    def at(self, theta: Mapping[str, float]) -> "Experiment":
        """The same with the noise at these parameters."""
        return self if self.noise_at is None else replace(self, noise=self.noise_at(theta))

    @property
    def measurement(self) -> Noise:
        """The noise without the model error."""
        return split_noise(self.noise)[0]

    @property
    def model_error_rms(self) -> float:
        """RMS of the simulator's usual error beyond its known residual; 0 where it is not known."""
        error = split_noise(self.noise)[1]
        if error is None:
            return 0.0
        return float(np.sqrt(np.mean(np.diag(error.covariance(samples(self.observed))))))

    @property
    def corrected(self) -> np.ndarray:
        """Observed less the simulator's known residual [*signal_shape]."""
        error, expected = split_noise(self.noise)[1], np.zeros(self.shape)
        if error is not None:
            expected[np.isfinite(self.observed)] = error.mean(samples(self.observed))
        return self.observed - expected


@dataclass(frozen=True)
class Proposal:
    """An experiment that could be made.

    Attributes:
        simulate, noise, identity: As of an `Experiment`.
        shape: Of its output.
        label: What to do, for a person.
        cost: Cost of the experiment, in any unit that all proposals share.

    Raises:
        ValueError: a field is of another kind, or the cost is negative.
    """

    simulate: Simulator
    noise: Noise
    shape: tuple[int, ...]
    identity: str = ""
    label: str = "experiment"
    cost: float = 0.0

    def __post_init__(self) -> None:
        check_function("simulate", self.simulate)
        check_noise(f"{self.label}: noise", self.noise)
        check_kind("shape", self.shape, tuple)
        for length in self.shape:
            checked_integer("each of shape", length)
        checked_number("cost", self.cost, lambda cost: 0.0 <= cost < math.inf, "0 or more")


@dataclass(frozen=True)
class Extension:
    """An effect that a simulator can be asked for.

    Attributes:
        prior: Of its coefficient; it also says how far runs may go to learn what the effect does.
        neutral: Coefficient at which the simulator is as without it.
        unit: Of the coefficient.
        text: One sentence for a person.

    Raises:
        ValueError: `neutral` is not finite, or not in the prior's support.
    """

    prior: dist.Distribution
    neutral: float = 0.0
    unit: str = "1"
    text: str = ""

    def __post_init__(self) -> None:
        support = Prior({"coefficient": self.prior})

        def possible(at: float) -> bool:
            return math.isfinite(at) and bool(support.contains({"coefficient": np.asarray(at)}))

        due = "finite and in the prior's support"
        checked_number("an extension's neutral", self.neutral, possible, due)
        check_text("unit", self.unit)
        check_text("text", self.text)


Extensions = Mapping[str, Extension]


def extended(prior: Prior, extensions: Extensions, names: tuple[str, ...]) -> Prior:
    """The prior of the base parameters and of the named coefficients."""
    added = {name: extensions[name] for name in names}
    return Prior(
        {**prior.distributions, **{name: e.prior for name, e in added.items()}},
        {**prior.units, **{name: e.unit for name, e in added.items()}},
    )


def check_extensions(prior: Prior, extensions: object) -> None:
    """Raise ValueError unless they map new names to extensions."""
    if not isinstance(extensions, Mapping):
        raise ValueError(f"extensions must map names to an Extension, got {extensions!r:.100}")
    for name, extension in extensions.items():
        check_kind(f"extension {name!r}", extension, Extension)
        if name in (*prior.names, NONE, OTHER):
            raise ValueError(
                f"extension {name!r} has the name of a parameter of the prior, or of a verdict; "
                "choose another name"
            )
