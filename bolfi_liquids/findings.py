"""All that a criticism came to know, before it is written."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import inference
    from .calibration import Calibration
    from .clean_recordings import Clean
    from .criticism_inputs import Inputs


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a criticism came to know."""

    calibration: "Calibration"
    inputs: "Inputs"
    baseline: "tuple[Clean, ...]"
    stirs: "inference.Criticism"
    pours: "inference.Criticism | None"

    @property
    def sources(self) -> "dict[str, inference.Criticism]":
        """By name."""
        pours = {} if self.pours is None else {"pours": self.pours}
        return {"stirs": self.stirs, **pours}

    @property
    def extended(self) -> "inference.Hypothesis":
        """The last model that was extended, or else the stirs' base model."""
        for source in reversed(list(self.sources.values())):
            if source.extended is not None:
                return source.extended
        return self.stirs.base.hypothesis

    @property
    def accepted(self) -> tuple[str, ...]:
        """Effects that joined the model."""
        return tuple(name for source in self.sources.values() for name in source.accepted)
