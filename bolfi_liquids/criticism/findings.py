"""The results of a criticism before they are written."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .. import inference
    from ..calibration.model_error import Clean
    from ..calibration.result import Calibration
    from .inputs import Inputs


@dataclass(frozen=True, eq=False)
class Findings:
    """The results of a criticism, by source."""

    calibration: "Calibration"
    inputs: "Inputs"
    cameras: "inference.criticism.AutoregressiveNoise"
    baseline: "tuple[Clean, ...]"
    stirs: "inference.criticism.Criticism"
    pours: "inference.criticism.Criticism | None"

    @property
    def sources(self) -> "dict[str, inference.criticism.Criticism]":
        """By name."""
        pours = {} if self.pours is None else {"pours": self.pours}
        return {"stirs": self.stirs, **pours}

    @property
    def models(self) -> "tuple[inference.criticism.Hypothesis, ...]":
        """The last model that was extended, or else the stirs' base model; and the stirs' before
        it, where it knows of effects that do not act in pours."""
        stirs = self.stirs.extended or self.stirs.base.hypothesis
        last = self.pours and self.pours.extended
        if last is None:
            return (stirs,)
        return (last,) if set(stirs.names) <= set(last.fit.prior.names) else (last, stirs)

    @property
    def best(self) -> dict[str, float]:
        """The most probable parameters and coefficients of these models."""
        return {name: value for model in self.models[::-1] for name, value in model.best.items()}

    @property
    def requested(self) -> tuple[str, ...]:
        """Those of the accepted effects that the user asked for."""
        asked = self.inputs.settings.accept or ()
        return tuple(name for name in self.accepted if name in asked)

    @property
    def unsupported(self) -> tuple[str, ...]:
        """Those of the requested that do not explain the difference: the test rejects them, or
        held-out data do."""
        return tuple(
            name
            for source in self.sources.values()
            if source.leading is not None and not source.leading.accepted
            for name in source.accepted
        )

    @property
    def accepted(self) -> tuple[str, ...]:
        """Effects that joined the model."""
        return tuple(name for source in self.sources.values() for name in source.accepted)
