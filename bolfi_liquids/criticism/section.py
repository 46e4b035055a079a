"""The section "criticise" of summary.json."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..calibration.noise import rms
from ..calibration.section import parameter_summary
from ..inputs.settings import FALSE_ALARM_RATE
from .findings import Findings

if TYPE_CHECKING:
    from xarray import DataTree

    from .. import inference

PLACE = ("channel", "start_s", "stop_s", "stroke")  # of a window; null where it has several


def criticism_section(findings: Findings, tree: "DataTree", seconds: float) -> dict[str, Any]:
    """Numbers of a criticism, in the design's form."""
    stirs = findings.stirs
    posterior = tree["posterior"].to_dataset()
    kind, effects = _together(findings)
    p_values = [source.verdict.p_value for source in findings.sources.values()]
    return {
        "verdict": kind,
        "effects": list(effects),
        "accepted": list(findings.accepted),
        "requested": list(findings.requested),
        "unsupported": list(findings.unsupported),
        "refuted": [name for source in findings.sources.values() for name in _refuted(source)],
        "held_out": min(_held_out(source) for source in _saying(kind, findings)),
        "reason": " ".join(source.verdict.reason for source in findings.sources.values()),
        "p_value": min(1.0, len(p_values) * min(p_values)),
        "where": _sure(stirs),
        "coefficient": {name: parameter_summary(posterior[name]) for name in findings.accepted},
        "parameters": {str(name): parameter_summary(draws) for name, draws in posterior.items()},
        "best": findings.best,
        "n_simulations": sum(source.simulations for source in findings.sources.values())
        + sum(clean.simulations for clean in findings.baseline),
        "gap_deg": _gap_deg(stirs),
        "stirs": _verdict(stirs),
        "pours": None if findings.pours is None else _pour_gap(findings.pours),
        "suggestions": [
            {"experiment": one.label, "between": list(one.between), "snr": one.snr}
            for source in findings.sources.values()
            for one in source.suggestions
        ],
        "untested": [name for source in findings.sources.values() for name in source.untested],
        "baseline": len(findings.baseline),
        "baseline_left_out": list(findings.inputs.left_out),
        "noise": _noise(findings),
        "seconds": seconds,
        "made_from": findings.inputs.made_from,
    }


def _together(findings: Findings) -> tuple[str, tuple[str, ...]]:
    """One verdict on all data: what was named anywhere, or else the gravest."""
    for kind in ("effect", "tie", "unknown"):
        if named := _saying(kind, findings):
            return kind, tuple(name for source in named for name in source.verdict.effects)
    return "none", ()


def _saying(kind: str, findings: Findings) -> "list[inference.criticism.Criticism]":
    """The sources of this verdict."""
    return [source for source in findings.sources.values() if source.verdict.kind == kind]


def _refuted(source: "inference.criticism.Criticism") -> list[str]:
    """Explanations that held-out data do not bear out."""
    return [" with ".join(names) for names in source.refuted]


def _held_out(source: "inference.criticism.Criticism") -> int:
    """Data held out on which something was tried."""
    return max(map(len, source.gaps.values()), default=0)


def _sure(source: "inference.criticism.Criticism") -> list[dict[str, Any]]:
    """The windows in which the base model and the data surely differ, surest first."""
    sure = [found for found in source.before if found.p_value < FALSE_ALARM_RATE]
    ordered = sorted(sure, key=lambda found: (found.p_value, -abs(found.z)))
    return [
        {
            **dict.fromkeys(PLACE),
            **found.label,
            "rms_deg": float(np.degrees(found.rms)),
            "p_value": found.p_value,
        }
        for found in ordered
    ]


def _rms(hypothesis: "inference.criticism.Hypothesis") -> float:
    return rms(hypothesis.difference)


def _degrees(value: float | None) -> float | None:
    return None if value is None else float(np.degrees(value))


def _gap_deg(source: "inference.criticism.Criticism") -> dict[str, float | None]:
    """The gap before and after, by what was accepted or else by the best of what is tied.

    A gap is the RMS of observed less expected beyond what the cameras and the simulator's own
    noise would leave of a right model, in quadrature; the RMS itself stands beside it.
    """
    from ..inference.criticism import beyond

    best = source.leading
    base = source.base.hypothesis
    own = np.diag(base.own) + np.diag(source.measurement)
    gaps = () if best is None else source.gaps.get(best.names, ())

    def pooled(values: list[float]) -> float | None:
        return rms(np.array(values)) if values else None

    after = best and _rms(best.hypothesis)
    noise = rms(np.sqrt(own))
    numbers = {
        "before": beyond(_rms(base), noise),
        "after": None if after is None else beyond(after, noise),
        "held_out_before": pooled([gap.excess[0] for gap in gaps]),
        "held_out_after": pooled([gap.excess[1] for gap in gaps]),
        "noise": noise,
        "rms_before": _rms(base),
        "rms_after": after,
        "held_out_rms_before": pooled([gap.before for gap in gaps]),
        "held_out_rms_after": pooled([gap.after for gap in gaps]),
        "held_out_noise": pooled([gap.noise for gap in gaps]),
    }
    return {name: _degrees(value) for name, value in numbers.items()}


def _pour_gap(source: "inference.criticism.Criticism") -> dict[str, Any]:
    """RMS of the spilled and retained fractions, and the verdict on the pours alone."""
    best = source.leading
    return {
        "before": _rms(source.base.hypothesis),
        "after": best and _rms(best.hypothesis),
        **_verdict(source),
    }


def _verdict(source: "inference.criticism.Criticism") -> dict[str, Any]:
    """On one kind of data."""
    return {
        "verdict": source.verdict.kind,
        "effects": list(source.verdict.effects),
        "p_value": source.verdict.p_value,
        "refuted": _refuted(source),
        "held_out": _held_out(source),
    }


def _noise(findings: Findings) -> Mapping[str, float]:
    """The cameras' noise as it was learned, and how well."""
    noise = findings.cameras
    return {
        "sd_deg": float(np.degrees(noise.sd.mean())),
        "sd_uncertainty": float(noise.sd.std() / noise.sd.mean()),
        "correlation": float(noise.correlation.mean()),
        "samples": noise.samples,
    }
