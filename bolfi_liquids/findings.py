"""All that a criticism came to know, before it is written."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import inference
    from .calibration import Calibration
    from .pour_table import PourTable
    from .recordings import Recording
    from .settings import CriticismSettings
    from .stirring import Stirring


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a criticism came to know."""

    calibration: "Calibration"
    stirring: "Stirring"
    stirs: "inference.Criticism"
    pours: "inference.Criticism | None"
    table: "PourTable | None"
    baseline: "tuple[Recording, ...]"
    settings: "CriticismSettings"

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
