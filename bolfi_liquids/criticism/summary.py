"""The section "criticise" of summary.json."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Field

from ..calibration.summary import ParameterSummary
from ..inference.criticism.verdict_kind import VerdictKind
from ..inputs.frame import named_faults
from ..run.summary import Number, Section
from .source_summary import (
    DifferingWindow,
    GapSummary,
    PourVerdict,
    SourceVerdict,
    held_out_count,
    refuted_by_held_out,
    significant_windows,
)

if TYPE_CHECKING:
    from xarray import DataTree

    from .. import inference
    from .findings import Findings

GRAVEST_FIRST = (VerdictKind.EFFECT, VerdictKind.TIE, VerdictKind.UNKNOWN)
"""Order in which the verdicts on several sources decide the one on all of them."""


@dataclass(frozen=True)
class SuggestedExperiment:
    """A further experiment.

    Attributes:
        experiment: What to do.
        between: Explanations that it would separate least.
        snr: Expected signal-to-noise ratio of their difference.
    """

    experiment: str
    between: tuple[str, ...]
    snr: Number


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
        accepted: Effects that joined the model.
        requested: Those of them that the user asked for.
        unsupported: Those of the requested that the data do not support.
        refuted: Explanations that held-out data contradict.
        held_out: Number of held-out data on which something was tried.
        reason: For the verdict.
        p_value: Of the base model, corrected for the number of sources.
        where: Windows in which the base model and the stirs differ, most significant first.
        coefficient: Of each accepted effect.
        parameters: All those of the last model.
        best: Their most probable values.
        n_simulations: Number made for all of this.
        gap: Between stirs and model, before and after.
        stirs: The verdict on them alone.
        pours: The verdict on them alone; None where there are none.
        suggestions: Further experiments.
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
    accepted: tuple[str, ...]
    requested: tuple[str, ...]
    unsupported: tuple[str, ...]
    refuted: tuple[str, ...]
    held_out: int
    reason: str
    p_value: Number
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
    def from_findings(cls, findings: "Findings", tree: "DataTree", seconds: float) -> Self:
        """From what a criticism found, its criticism.nc and the time that it took [s]."""
        sources, posterior = tuple(findings.sources.values()), tree["posterior"].to_dataset()
        verdict, effects = _together(sources)
        p_values = [source.verdict.p_value for source in sources]
        made = sum(one.simulations for one in (*sources, *findings.baseline))
        return cls(
            verdict=verdict,
            effects=effects,
            accepted=findings.accepted,
            requested=findings.requested,
            unsupported=findings.unsupported,
            refuted=tuple(name for source in sources for name in refuted_by_held_out(source)),
            held_out=min(held_out_count(source) for source in _concluding(verdict, sources)),
            reason=" ".join(source.verdict.reason for source in sources),
            p_value=min(1.0, len(p_values) * min(p_values)),
            where=significant_windows(findings.stirs),
            coefficient={name: ParameterSummary.of(posterior[name]) for name in findings.accepted},
            parameters={str(name): ParameterSummary.of(of) for name, of in posterior.items()},
            best=findings.best,
            n_simulations=made,
            gap=GapSummary.of(findings.stirs),
            stirs=SourceVerdict.of(findings.stirs),
            pours=None if findings.pours is None else PourVerdict.of(findings.pours),
            suggestions=tuple(
                SuggestedExperiment(one.label, tuple(one.between), one.snr)
                for source in sources
                for one in source.suggestions
            ),
            untested=tuple(name for source in sources for name in source.untested),
            baseline=len(findings.baseline),
            baseline_left_out=tuple(findings.inputs.left_out),
            noise=CameraNoise.of(findings.cameras),
            seconds=seconds,
            made_from=findings.inputs.made_from,
            frame_faults=named_faults(findings.inputs.compared),
        )

    def to_json(self) -> dict[str, Any]:
        """The section as `json.dumps` takes it; the window of a stroke has no `speed`."""
        section = super().to_json()
        for window in section["where"]:
            if window["speed"] is None:
                del window["speed"]
        return section

    @property
    def considered(self) -> tuple[str, ...]:
        """Effects that alone could be named; empty where all could."""
        return tuple(self.made_from["settings"]["effects"] or ())


def _together(
    sources: "Sequence[inference.criticism.Criticism]",
) -> tuple[VerdictKind, tuple[str, ...]]:
    """One verdict on all data: what was named anywhere, or else the gravest."""
    for verdict in GRAVEST_FIRST:
        if named := _concluding(verdict, sources):
            return verdict, tuple(name for source in named for name in source.verdict.effects)
    return VerdictKind.AGREEMENT, ()


def _concluding(
    verdict: VerdictKind, sources: "Sequence[inference.criticism.Criticism]"
) -> "list[inference.criticism.Criticism]":
    """The sources of this verdict."""
    return [source for source in sources if source.verdict.kind == verdict]
