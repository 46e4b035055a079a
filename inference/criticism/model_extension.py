"""What a model may lack: an effect of one coefficient."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpyro.distributions as dist

from ..arguments import check_text, checked_number
from ..prior import Prior


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
        checked_number("an extension's neutral", self.neutral, math.isfinite, "finite")
        check_text("unit", self.unit)
        check_text("text", self.text)
        inside = Prior({"coefficient": self.prior}).contains(
            {"coefficient": np.asarray(self.neutral)}
        )
        if not inside:
            raise ValueError(
                f"an extension's neutral must lie in the prior's support, got {self.neutral!r}"
            )


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
    if not isinstance(extensions, Mapping) or not extensions:
        raise ValueError(
            f"extensions must map at least one name to an Extension, got {extensions!r:.100}"
        )
    for name, extension in extensions.items():
        if name in prior.names:
            raise ValueError(f"extension {name!r} has the name of a parameter of the prior")
        if not isinstance(extension, Extension):
            raise ValueError(f"extension {name!r} must be an Extension, got {extension!r:.100}")
