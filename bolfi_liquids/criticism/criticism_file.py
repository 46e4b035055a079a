"""criticism.nc: everything that a report shows of a criticism.

Its groups, under `stirs` and, where pours were given, under `pours`:

- `residual`: over the data's own dimensions, `observed`, and with `_before` and `_after` the
  expectation of the base and of the extended model, and the sd of observed less expected;
- `where`: over windows, their labels, and RMS, z and p-value before and after;
- `effects`: over effects, what was found out about each; `unit` is that of `typical` and
  `coefficient`, `side` the sign of the scores that count, 0 where both do;
- `confusion`: cosines between the effects' signatures;
- `held_out`: over explanations and recordings, the gap before and after;
- `suggestions`: over further experiments, how well each would separate the explanations.

`posterior` holds the draws of the extended model, or of the base model where there is none.
"""

from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from ..inference.criticism.verdict_kind import VerdictKind
from ..inputs.fields import PLANE_NAMES
from .findings import Findings

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from .. import inference


UNITS = {"stirs": {"units": "rad"}, "pours": {"units": "1"}}
DIMENSIONLESS = {"units": "1"}


class EffectStatus(StrEnum):
    """What became of an effect as an explanation; its spelling is that in criticism.nc."""

    NAMED = "named"
    POSSIBLE = "possible"
    LESS_LIKELY = "less likely"
    REFUTED = "refuted by held-out data"
    REJECTED = "rejected"
    NOT_NEEDED = "not needed"
    NOT_REFITTED = "untested by a refit"
    FAILED = "untested: its simulations failed"


def criticism_tree(findings: Findings) -> "DataTree":
    """Everything that a report shows."""
    from xarray import DataTree

    groups: dict[str, Any] = {"/posterior": _posterior(findings)}
    for name, source in findings.sources.items():
        groups[f"/{name}/residual"] = _residual(findings, name, source)
        groups[f"/{name}/where"] = _where(source, UNITS[name])
        groups[f"/{name}/effects"] = _effects(source)
        groups[f"/{name}/confusion"] = _confusion(source)
        if source.gaps:
            groups[f"/{name}/held_out"] = _held_out(source, UNITS[name])
        if source.suggestions:
            groups[f"/{name}/suggestions"] = _suggestions(source)
    tree = DataTree.from_dict(groups)
    tree.attrs.update(
        accepted=list(findings.accepted),
        requested=list(findings.requested),
        liquid_density=findings.calibration.liquid_density,
    )
    return tree


def _posterior(findings: Findings) -> "Dataset":
    """Draws of all parameters; coefficients that act in stirs alone are those of the stirs."""
    seed = findings.inputs.settings.seed
    sampled = [
        model.fit.sample("nuts", chains=4, draws=1000, seed=seed)["posterior"].to_dataset()
        for model in findings.models
    ]
    known = sampled[0]
    for other in sampled[1:]:
        known = known.assign({n: v for n, v in other.items() if n not in known})
    return known


def _residual(findings: Findings, name: str, source: "inference.criticism.Criticism") -> "Dataset":
    from xarray import Dataset

    if name == "stirs":
        dims = ("frame", "plane")
        time = findings.inputs.stirring.time
        coords = {
            "time": ("frame", time, {"units": "s"}),
            "recording": ("frame", findings.inputs.stirring.member),
            "plane": list(PLANE_NAMES),
        }
    else:
        table = findings.inputs.table
        assert table is not None
        dims = ("outcome", "pour")
        coords = {
            "angular_velocity": ("pour", table.angular_velocity, {"units": "rad s-1"}),
            "distance": ("pour", table.distance, {"units": "m"}),
            "outcome": ["spilled", "retained"],
        }
    columns = {"observed": (dims, source.observed)}
    models = {"before": source.base.hypothesis, "after": source.extended}
    for when, hypothesis in models.items():
        if hypothesis is not None:
            left, sd = _left(hypothesis)
            expected = source.observed - left
            columns |= {f"expected_{when}": (dims, expected), f"sd_{when}": (dims, sd)}
    return Dataset({key: (*of, UNITS[name]) for key, of in columns.items()}, coords=coords)


def _left(hypothesis: "inference.criticism.Hypothesis") -> tuple[np.ndarray, np.ndarray]:
    """Observed less expected, what is known to be usual included, and its sd."""
    output = hypothesis.surrogate.output
    sd = np.sqrt(np.diag(hypothesis.spread + hypothesis.noise))
    return output.restore(hypothesis.difference[None])[0], output.restore(sd[None])[0]


def _where(source: "inference.criticism.Criticism", units: dict[str, str]) -> "Dataset":
    from xarray import Dataset

    keys = {key: type(value) for found in source.before for key, value in found.label.items()}
    columns: dict[str, Any] = {
        key: ("window", [found.label.get(key, _MISSING_LABEL[kind]) for found in source.before])
        for key, kind in keys.items()
    }
    for when, windows in (("before", source.before), ("after", source.after)):
        if windows:
            for field, of in (("rms", units), ("z", DIMENSIONLESS), ("p_value", DIMENSIONLESS)):
                values = [getattr(found, field) for found in windows]
                columns[f"{field}_{when}"] = ("window", values, of)
    return Dataset(columns)


_MISSING_LABEL: dict[type, Any] = {str: "", int: -1, float: float("nan")}


def _effects(source: "inference.criticism.Criticism") -> "Dataset":
    from xarray import Dataset

    signatures, singles = source.base.signatures, source.singles
    names = list(dict.fromkeys((*signatures, *source.untested)))

    def of(name: str) -> dict[str, Any]:
        if name not in signatures:
            return {"status": EffectStatus.FAILED}
        found = {
            "typical": signatures[name].coefficient,
            "snr": signatures[name].snr,
            "score": source.base.check.scores.get(name, np.nan),
            "side": float(signatures[name].side),
        }
        candidate = singles.get(name)
        if candidate is None:
            return {**found, "status": EffectStatus.NOT_NEEDED}
        return {
            **found,
            "gain": candidate.gain,
            "p_value": candidate.check.p_value,
            "coefficient": candidate.hypothesis.best[name],
            "status": _status(candidate, source),
        }

    rows = [of(name) for name in names]
    numbers = ("typical", "snr", "score", "side", "gain", "p_value", "coefficient")
    columns = {key: ("effect", [row.get(key, np.nan) for row in rows]) for key in numbers}
    status = ("effect", [str(row["status"]) for row in rows])
    units = ("effect", [source.units[name] for name in names])
    return Dataset({**columns, "unit": units, "status": status}, coords={"effect": names})


def _status(
    candidate: "inference.criticism.Candidate", source: "inference.criticism.Criticism"
) -> EffectStatus:
    """What became of an explanation by one effect."""
    if candidate.names[0] in source.verdict.effects:
        named = source.verdict.kind == VerdictKind.EFFECT
        return EffectStatus.NAMED if named else EffectStatus.POSSIBLE
    if not candidate.passes:
        return EffectStatus.REJECTED
    if candidate.names in source.refuted:
        return EffectStatus.REFUTED
    if not candidate.refitted:
        return EffectStatus.NOT_REFITTED
    return EffectStatus.LESS_LIKELY


def _confusion(source: "inference.criticism.Criticism") -> "Dataset":
    from xarray import Dataset

    names = list(source.base.signatures)
    return Dataset(
        {"cosine": (("effect", "other"), source.confusion)},
        coords={"effect": names, "other": names},
    )


def _held_out(source: "inference.criticism.Criticism", units: dict[str, str]) -> "Dataset":
    from xarray import Dataset

    names = [" with ".join(explanation) for explanation in source.gaps]
    gaps = list(source.gaps.values())
    columns: dict[str, Any] = {
        field: (
            ("explanation", "recording"),
            [[getattr(gap, field) for gap in row] for row in gaps],
            DIMENSIONLESS if field in ("p_value", "lpd_gain") else units,
        )
        for field in ("before", "after", "noise", "floor", "p_value", "lpd_gain")
    }
    columns["holds"] = ("explanation", [source.holds(key) for key in source.gaps])
    labels = [gap.label for gap in gaps[0]]
    return Dataset(columns, coords={"explanation": names, "recording": labels})


def _suggestions(source: "inference.criticism.Criticism") -> "Dataset":
    from xarray import Dataset

    return Dataset(
        {
            "snr": ("experiment", [one.snr for one in source.suggestions]),
            "between": ("experiment", [" or ".join(one.between) for one in source.suggestions]),
        },
        coords={"experiment": [one.label for one in source.suggestions]},
    )
