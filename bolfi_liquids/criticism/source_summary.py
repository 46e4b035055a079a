"""What summary.json holds of one source of a criticism: stirs, or pours."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..calibration.noise import rms
from ..inference.criticism.verdict_kind import VerdictKind
from ..inputs.settings import FALSE_ALARM_RATE
from ..run.summary import Number

if TYPE_CHECKING:
    from .. import inference


@dataclass(frozen=True)
class SourceVerdict:
    """The verdict on one kind of data.

    Attributes:
        verdict: The conclusion.
        effects: What it names: the effect, or those that are tied.
        p_value: Of the base model.
        refuted: Explanations that held-out data contradict.
        held_out: Number of held-out data on which something was tried.
    """

    verdict: VerdictKind
    effects: tuple[str, ...]
    p_value: Number
    refuted: tuple[str, ...]
    held_out: int

    @classmethod
    def of(cls, source: "inference.criticism.Criticism") -> Self:
        """From what the engine concluded."""
        verdict = source.verdict
        return cls(
            VerdictKind(verdict.kind),
            tuple(verdict.effects),
            verdict.p_value,
            tuple(" with ".join(names) for names in source.refuted),
            max(map(len, source.gaps.values()), default=0),
        )


@dataclass(frozen=True)
class PourVerdict(SourceVerdict):
    """The verdict on pours.

    Attributes:
        before, after: RMS of observed less expected fractions, by the base model and by the best
            explanation; None where none was tried.
    """

    before: Number
    after: float | None

    @classmethod
    def of(cls, source: "inference.criticism.Criticism") -> Self:
        """From what the engine concluded."""
        best, common = source.leading, SourceVerdict.of(source)
        after = None if best is None else _rms(best.hypothesis)
        return cls(**vars(common), before=_rms(source.base.hypothesis), after=after)


@dataclass(frozen=True)
class DifferingWindow:
    """Part of a recording in which the base model and the data differ significantly.

    Attributes:
        channel: Plane; None where both count.
        start_s, stop_s: Its ends [s]; None where it is not one stretch.
        stroke: Number, from 1, 0 before the first; None where it is of one speed.
        recording: Name of the file.
        speed: Range of the gripper's speeds; None where it is a stroke.
        rms_deg: Of observed less expected [deg].
        p_value: Corrected for the number of windows.
    """

    channel: str | None
    start_s: float | None
    stop_s: float | None
    stroke: int | None
    recording: str
    rms_deg: Number
    p_value: Number
    speed: str | None = None

    @classmethod
    def of(cls, found: "inference.criticism.Found") -> Self:
        """From what the engine found."""
        nowhere = dict.fromkeys(("channel", "start_s", "stop_s", "stroke"))
        place: dict[str, Any] = {**nowhere, **found.label}
        return cls(**place, rms_deg=float(np.degrees(found.rms)), p_value=found.p_value)


@dataclass(frozen=True)
class GapSummary:
    """RMS of recorded less expected inclination [deg], before and after an effect was added.

    After: by what was accepted, or else by the best of what is tied; None where nothing was tried
    or held out.

    Attributes:
        before, after: What exceeds noise and the usual residual, in quadrature.
        held_out_before, held_out_after: The same on recordings that were not fitted.
        noise, held_out_noise: What cameras and simulator's seeds leave of a right model.
        usual, held_out_usual: What the simulator leaves of clean recordings besides, 0 where none
            was given; the latter is None where nothing was held out.
        rms_before, rms_after, held_out_rms_before, held_out_rms_after: The RMS itself.
    """

    before: Number
    after: float | None
    held_out_before: float | None
    held_out_after: float | None
    noise: Number
    rms_before: Number
    rms_after: float | None
    held_out_rms_before: float | None
    held_out_rms_after: float | None
    held_out_noise: float | None
    usual: float
    held_out_usual: float | None

    @classmethod
    def of(cls, source: "inference.criticism.Criticism") -> Self:
        """From what the engine concluded on stirs."""
        from ..inference.criticism import beyond

        best, base = source.leading, source.base.hypothesis
        gaps = () if best is None else source.gaps.get(best.names, ())
        noise = rms(np.sqrt(np.diag(base.own) + np.diag(source.measurement)))
        known = float(np.hypot(noise, source.usual))
        before, after = _rms(base), None if best is None else _rms(best.hypothesis)
        numbers = {
            "before": beyond(before, known),
            "after": None if after is None else beyond(after, known),
            "noise": noise,
            "usual": source.usual,
            "rms_before": before,
            "rms_after": after,
        }
        held_out = {
            "before": [gap.unexplained[0] for gap in gaps],
            "after": [gap.unexplained[1] for gap in gaps],
            "noise": [gap.noise for gap in gaps],
            "usual": [gap.usual for gap in gaps],
            "rms_before": [gap.before for gap in gaps],
            "rms_after": [gap.after for gap in gaps],
        }
        numbers |= {
            f"held_out_{name}": rms(np.array(of)) if of else None for name, of in held_out.items()
        }
        in_degrees: dict[str, Any] = {
            name: None if value is None else float(np.degrees(value))
            for name, value in numbers.items()
        }
        return cls(**in_degrees)


def significant_windows(source: "inference.criticism.Criticism") -> tuple[DifferingWindow, ...]:
    """The windows in which the base model and the data differ, most significant first."""
    found = [window for window in source.before if window.p_value < FALSE_ALARM_RATE]
    ordered = sorted(found, key=lambda window: (window.p_value, -abs(window.z)))
    return tuple(DifferingWindow.of(window) for window in ordered)


def _rms(hypothesis: "inference.criticism.Hypothesis") -> float:
    return rms(hypothesis.difference)
