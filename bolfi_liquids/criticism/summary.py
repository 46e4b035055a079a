"""The section "criticise" of summary.json."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Field

from ..calibration.stirs import rms
from ..calibration.summary import ParameterSummary
from ..inference.criticism.verdict_kind import VerdictKind
from ..inputs.frame import named_faults
from ..inputs.settings import FALSE_ALARM_RATE
from ..motions import Motion
from ..run.results import Number, Section
from .criticism_file import best_of

if TYPE_CHECKING:
    from xarray import DataTree

    from .. import inference
    from .criticism_file import Sources
    from .inputs import Inputs

GRAVEST_FIRST = (VerdictKind.EFFECT, VerdictKind.TIE, VerdictKind.UNKNOWN)
"""Order in which the verdicts on several sources decide the one on all of them."""


@dataclass(frozen=True)
class SourceVerdict:
    """The verdict on one kind of data.

    Attributes:
        verdict: The conclusion.
        effects: What it names: the effect, or those that are tied.
        perhaps: Effects that may act besides, and the probability that they do.
        p_value: Of the base model.
        probability: That the verdict is right.
        probabilities: Of "none", of each explanation and of "none of these".
        limits: Effect -> distance of its coefficient from neutral that it does not exceed with 95 %
            probability if it acts alone, in its unit; empty where something is missing.
        refuted: Explanations that held-out data contradict.
        held_out: Number of held-out data on which something was tried.
    """

    verdict: VerdictKind
    effects: tuple[str, ...]
    perhaps: Mapping[str, Number]
    p_value: Number
    probability: Number
    probabilities: Mapping[str, Number]
    limits: Mapping[str, Number]
    refuted: tuple[str, ...]
    held_out: int

    @classmethod
    def of(cls, source: "inference.criticism.Criticism") -> Self:
        """From what the engine concluded."""
        verdict = source.verdict
        agrees = verdict.kind is VerdictKind.AGREEMENT
        return cls(
            VerdictKind(verdict.kind),
            tuple(verdict.effects),
            dict(verdict.perhaps),
            verdict.p_value,
            verdict.probability,
            dict(source.probabilities),
            {name: one.limit for name, one in source.sensitivities.items() if agrees},
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
        usual, held_out_usual: What the simulator is known, or was seen, to leave of clean
            recordings besides; the latter is None where nothing was held out.
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
        from ..inference.criticism import excess_rms
        from ..inference.criticism.measurement_noise import samples

        best, base = source.leading, source.base.hypothesis
        gaps = () if best is None else source.gaps.get(best.names, ())
        data = source.experiment
        measured = data.measurement.covariance(samples(data.observed))
        noise = rms(np.sqrt(np.diag(base.own) + np.diag(measured)))
        known = float(np.hypot(noise, data.model_error_rms))
        before, after = _rms(base), None if best is None else _rms(best.hypothesis)
        numbers: dict[str, Any] = {
            "before": excess_rms(before, known),
            "after": None if after is None else excess_rms(after, known),
            "noise": noise,
            "usual": data.model_error_rms,
            "rms_before": before,
            "rms_after": after,
        }
        held_out = [
            (*gap.unexplained, gap.noise, gap.model_error, gap.before, gap.after) for gap in gaps
        ]
        columns = np.transpose(held_out) if held_out else [None] * len(numbers)
        numbers |= {
            f"held_out_{name}": None if of is None else rms(of)
            for name, of in zip(list(numbers), columns, strict=True)
        }
        in_degrees: dict[str, Any] = {
            name: None if of is None else float(np.degrees(of)) for name, of in numbers.items()
        }
        return cls(**in_degrees)


def significant_windows(source: "inference.criticism.Criticism") -> tuple[DifferingWindow, ...]:
    """The windows in which the base model and the data differ, most significant first."""
    found = [window for window in source.before if window.p_value < FALSE_ALARM_RATE]
    ordered = sorted(found, key=lambda window: (window.p_value, -abs(window.z)))
    return tuple(DifferingWindow.of(window) for window in ordered)


def _rms(hypothesis: "inference.criticism.Hypothesis") -> float:
    return rms(hypothesis.difference)


@dataclass(frozen=True)
class SuggestedExperiment:
    """A further experiment.

    Attributes:
        experiment: What to do.
        between: Explanations that it would separate least.
        snr: Expected signal-to-noise ratio of their difference.
        wrong_before, wrong_after: Expected rate of wrong names, if the most probable explanation
            is named now, and after the experiment.
        cost_s: Duration of the stir or of the source's turn [s].
        motion: Of a stir, as `record --motion` takes it.
    """

    experiment: str
    between: tuple[str, ...]
    snr: Number
    wrong_before: Number
    wrong_after: Number
    cost_s: Number
    motion: Mapping[str, Any] | None = None

    @classmethod
    def of(cls, one: "inference.criticism.Suggestion", motions: Sequence[Motion]) -> Self:
        """From the engine's suggestion of one of these motions, or of a pour."""
        planned = {motion.label: asdict(motion) for motion in motions}
        motion = planned.get(one.label)
        return cls(one.label, one.between, one.snr, one.before, one.error, one.cost, motion)


@dataclass(frozen=True)
class CameraNoise:
    """The cameras' noise as it was learned before the gripper moved.

    Attributes:
        sd_deg: Standard deviation [deg].
        sd_uncertainty: Relative uncertainty of it.
        correlation: From one sample to the next.
        samples: Number that it was learned from.
    """

    sd_deg: Number
    sd_uncertainty: Number
    correlation: Number
    samples: int

    @classmethod
    def of(cls, noise: "inference.criticism.AutoregressiveNoise") -> Self:
        """From the engine's estimate."""
        return cls(
            sd_deg=float(np.degrees(noise.sd.mean())),
            sd_uncertainty=float(noise.sd.std() / noise.sd.mean()),
            correlation=float(noise.correlation.mean()),
            samples=noise.samples,
        )


@dataclass(frozen=True)
class CriticismSummary(Section):
    """Numbers of a criticism.

    Attributes:
        verdict: On all data together.
        effects: What it names: the effect, or those that are tied.
        perhaps: Effects that may act besides, and the probability that they do.
        accepted: Effects that joined the model.
        requested: Those of them that the user asked for.
        unsupported: Those of the requested that the data do not support.
        refuted: Explanations that held-out data contradict.
        held_out: Number of held-out data on which something was tried.
        reason: For the verdict.
        p_value: Of the base model, corrected for the number of sources.
        probability: That the verdict is right, on all sources that give it.
        where: Windows in which the base model and the stirs differ, most significant first.
        coefficient: Of each accepted effect.
        parameters: All those of the last model.
        best: Their most probable values.
        n_simulations: Number made for all of this.
        gap: Between stirs and model, before and after.
        stirs: The verdict on them alone.
        pours: The verdict on them alone; None where there are none.
        suggestions: Further experiments, best first.
        untested: Effects whose simulations failed, or that were not refitted.
        baseline: Number of clean recordings.
        baseline_left_out: Recordings given as clean that are criticised or held out.
        noise: Of the cameras.
        seconds: That it took [s].
        made_from: Posterior, version, settings and hashes of the files.
        frame_faults: Held-out and clean recordings whose inclination and positions are not told in
            one frame, and how it is mended; see `inputs.frame`.
    """

    verdict: VerdictKind
    effects: tuple[str, ...]
    perhaps: Mapping[str, Number]
    accepted: tuple[str, ...]
    requested: tuple[str, ...]
    unsupported: tuple[str, ...]
    refuted: tuple[str, ...]
    held_out: int
    reason: str
    p_value: Number
    probability: Number
    where: tuple[DifferingWindow, ...]
    coefficient: Mapping[str, ParameterSummary]
    parameters: Mapping[str, ParameterSummary]
    best: Mapping[str, float]
    n_simulations: int
    gap: Annotated[GapSummary, Field(alias="gap_deg")]
    stirs: SourceVerdict
    pours: PourVerdict | None
    suggestions: tuple[SuggestedExperiment, ...]
    untested: tuple[str, ...]
    baseline: int
    baseline_left_out: tuple[str, ...]
    noise: CameraNoise
    seconds: Number
    made_from: Mapping[str, Any]
    frame_faults: tuple[str, ...]

    @classmethod
    def of(
        cls, inputs: "Inputs", sources: "Sources", clean: int, tree: "DataTree", seconds: float
    ) -> Self:
        """From what was given and found.

        Args:
            inputs: What decided it.
            sources: What was concluded on each.
            clean: Simulations of the clean recordings.
            tree: criticism.nc.
            seconds: Time that it took [s].
        """
        from ..inference.criticism.design import rank

        posterior, given = tree["posterior"].to_dataset(), sources.values()
        parameters = {str(name): ParameterSummary.of(of) for name, of in posterior.items()}
        verdicts = list(map(SourceVerdict.of, given))
        accepted, requested = (tuple(tree.attrs[name]) for name in ("accepted", "requested"))
        return cls(
            **_together(verdicts),
            accepted=accepted,
            requested=requested,
            unsupported=unsupported(sources),
            refuted=tuple(name for one in verdicts for name in one.refuted),
            reason=" ".join(source.verdict.reason for source in given),
            p_value=min(1.0, len(verdicts) * min(one.p_value for one in verdicts)),
            where=significant_windows(sources["stirs"]),
            coefficient={name: parameters[name] for name in accepted},
            parameters=parameters,
            best=best_of(sources),
            n_simulations=clean + sum(source.simulations for source in given),
            gap=GapSummary.of(sources["stirs"]),
            stirs=verdicts[0],
            pours=PourVerdict.of(sources["pours"]) if "pours" in sources else None,
            suggestions=tuple(
                SuggestedExperiment.of(one, inputs.motions)
                for one in sorted((one for of in given for one in of.suggestions), key=rank)
            ),
            untested=tuple(name for source in given for name in source.untested),
            baseline=len(inputs.clean),
            baseline_left_out=inputs.left_out,
            noise=CameraNoise.of(inputs.cameras),
            seconds=seconds,
            made_from=inputs.made_from,
            frame_faults=named_faults(inputs.compared),
        )

    def to_json(self) -> dict[str, Any]:
        """The section as `json.dumps` takes it; the window of a stroke has no `speed`."""
        section = super().to_json()
        for window in section["where"]:
            if window["speed"] is None:
                del window["speed"]
        return section

    @property
    def next_motion(self) -> Mapping[str, Any] | None:
        """Of the best suggested stir, if a stir is suggested."""
        return next((one.motion for one in self.suggestions if one.motion is not None), None)

    @property
    def considered(self) -> tuple[str, ...]:
        """Effects that alone could be named; empty where all could."""
        return tuple(self.made_from["settings"]["effects"] or ())


def unsupported(sources: "Sources") -> tuple[str, ...]:
    """Accepted effects that do not explain the difference: the test rejects them, or held-out data
    do."""
    return tuple(
        name
        for source in sources.values()
        if source.leading is not None and not source.leading.accepted
        for name in source.accepted
    )


def _together(sources: list[SourceVerdict]) -> dict[str, Any]:
    """Fields of the verdict on all data: what was named anywhere, or else the gravest. Sources that
    give it are all right with the product of their probabilities."""
    given = {source.verdict for source in sources}
    verdict = next((one for one in GRAVEST_FIRST if one in given), VerdictKind.AGREEMENT)
    agreed = [source for source in sources if source.verdict == verdict]
    return {
        "verdict": verdict,
        "effects": tuple(name for source in agreed for name in source.effects),
        "perhaps": {name: p for source in agreed for name, p in source.perhaps.items()},
        "held_out": min(source.held_out for source in agreed),
        "probability": math.prod(source.probability for source in agreed),
    }
