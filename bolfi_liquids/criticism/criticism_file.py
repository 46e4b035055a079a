"""criticism.nc: everything that a report shows of a criticism.

Its groups, under `stirs` and, where pours were given, under `pours`:

- `residual`: over the data's own dimensions, `observed`, and with `_before` and `_after` the
  expectation of the base and of the extended model, and the sd of observed less expected;
- `where`: over windows, their labels, and RMS, z and p-value before and after;
- `effects`: over effects, what was found out about each; `unit` is that of `typical`, `smallest`,
  `limit` and `coefficient`, `side` the sign of the scores that count, 0 where both do;
- `explanations`: over all of them, their probabilities;
- `confusion`: cosines between the effects' signatures, and how much of each the other leaves;
- `held_out`: over explanations and recordings, the gap before and after;
- `suggestions`: over further experiments, how well each would separate the explanations, the rate
  of wrong names before and after it, and its cost.

`posterior` holds the draws of the extended model, or of the base model where there is none.
"""

from collections.abc import Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from ..inference.criticism.verdict_kind import VerdictKind
from ..inputs.recording import PLANE_NAMES
from .pours import OUTCOMES

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from .. import inference
    from .inputs import Inputs

    Sources = Mapping[str, inference.criticism.Criticism]
    """What the engine concluded on "stirs" and, where some were given, on "pours"."""

ANGLE, DIMENSIONLESS = {"units": "rad"}, {"units": "1"}

LABELS: dict[type, Any] = {str: "", int: -1, float: float("nan")}
"""Value of a label that a window does not have."""

SUGGESTED = {
    "snr": ("snr", DIMENSIONLESS),
    "wrong_before": ("before", DIMENSIONLESS),
    "wrong_after": ("error", DIMENSIONLESS),
    "cost": ("cost", {"units": "s"}),
}
"""Variables of further experiments: fields and units."""


class EffectStatus(StrEnum):
    """Result of an effect as an explanation, spelled as in criticism.nc."""

    NAMED = "named"
    POSSIBLE = "possible"
    LESS_LIKELY = "less likely"
    REFUTED = "refuted by held-out data"
    GAINS_NOTHING = "rejected: explains nothing"
    STILL_DIFFERS = "rejected: the data still differ"
    NOT_NEEDED = "not needed"
    NOT_REFITTED = "untested by a refit"
    FAILED = "untested: its simulations failed"


def criticism_tree(inputs: "Inputs", sources: "Sources") -> "DataTree":
    """Everything that a report shows."""
    from xarray import DataTree

    groups = {"posterior": DataTree(_posterior(sources, inputs.settings.seed))}
    for name, source in sources.items():
        groups[name] = DataTree.from_dict(_groups(inputs, name, source))
    tree = DataTree(children=groups)
    accepted = [name for source in sources.values() for name in source.accepted]
    tree.attrs.update(
        accepted=accepted,
        requested=[name for name in accepted if name in (inputs.settings.accept or ())],
        liquid_density=inputs.density,
    )
    return tree


def _groups(
    inputs: "Inputs", name: str, source: "inference.criticism.Criticism"
) -> "dict[str, Dataset]":
    """The groups of "stirs" or "pours"."""
    from xarray import Dataset

    if name == "pours" and (table := inputs.table) is not None:
        dims, units = ("outcome", "pour"), DIMENSIONLESS
        coords = {
            "angular_velocity": ("pour", table.angular_velocity, {"units": "rad s-1"}),
            "distance": ("pour", table.distance, {"units": "m"}),
            "outcome": list(OUTCOMES),
        }
    else:
        dims, units = ("frame", "plane"), ANGLE
        coords = {
            "time": ("frame", inputs.stirring.time, {"units": "s"}),
            "recording": ("frame", inputs.stirring.member),
            "plane": list(PLANE_NAMES),
        }
    names = list(source.base.signatures)
    pairs = ("effect", "other")
    alike = {"cosine": (pairs, source.confusion), "isolability": (pairs, source.isolability)}
    groups = {
        "residual": _residual(source, dims, units).assign_coords(coords),
        "where": _where(source, units),
        "effects": _effects(source),
        "explanations": Dataset(
            {"probability": ("explanation", list(source.probabilities.values()))},
            coords={"explanation": list(source.probabilities)},
        ),
        "confusion": Dataset(alike, coords={"effect": names, "other": names}),
    }
    if source.gaps:
        groups["held_out"] = _held_out(source, units)
    if source.suggestions:
        columns: dict[str, Any] = {
            name: ("experiment", [getattr(one, field) for one in source.suggestions], unit)
            for name, (field, unit) in SUGGESTED.items()
        }
        between = [" or ".join(one.between) for one in source.suggestions]
        columns["between"] = ("experiment", between)
        labels = [one.label for one in source.suggestions]
        groups["suggestions"] = Dataset(columns, coords={"experiment": labels})
    return groups


def last_models(sources: "Sources") -> "list[inference.criticism.Hypothesis]":
    """The models that have all parameters: the pours' extended one, where there is one, and the
    stirs' last one, unless the pours' has all of its effects."""
    stirs = sources["stirs"].extended or sources["stirs"].base.hypothesis
    last = sources["pours"].extended if "pours" in sources else None
    if last is None:
        return [stirs]
    return [last] if set(stirs.names) <= set(last.fit.prior.names) else [last, stirs]


def best_of(sources: "Sources") -> dict[str, float]:
    """The most probable parameters and coefficients of these models."""
    return {k: v for model in last_models(sources)[::-1] for k, v in model.best.items()}


def _posterior(sources: "Sources", seed: int) -> "Dataset":
    """Draws of all parameters; coefficients that act in stirs alone are those of the stirs."""
    known, *others = (
        model.fit.sample("nuts", chains=4, draws=1000, seed=seed)["posterior"].to_dataset()
        for model in last_models(sources)
    )
    for other in others:
        known = known.assign({n: v for n, v in other.items() if n not in known})
    return known


def _residual(
    source: "inference.criticism.Criticism", dims: tuple[str, str], units: dict[str, str]
) -> "Dataset":
    from xarray import Dataset

    columns = {"observed": source.experiment.observed}
    for when, model in {"before": source.base.hypothesis, "after": source.extended}.items():
        if model is not None:
            # the usual model error counts as expected
            sd = np.sqrt(np.diag(model.spread + model.noise))
            whole = (model.surrogate.output.restore(of[None])[0] for of in (model.difference, sd))
            left, columns[f"sd_{when}"] = whole
            columns[f"expected_{when}"] = source.experiment.observed - left
    return Dataset({key: (dims, values, units) for key, values in columns.items()})


def _where(source: "inference.criticism.Criticism", units: dict[str, str]) -> "Dataset":
    from xarray import Dataset

    keys = {key: type(value) for found in source.before for key, value in found.label.items()}
    columns: dict[str, Any] = {
        key: ("window", [found.label.get(key, LABELS[kind]) for found in source.before])
        for key, kind in keys.items()
    }
    for when, windows in (("before", source.before), ("after", source.after)):
        if windows:
            for field, of in (("rms", units), ("z", DIMENSIONLESS), ("p_value", DIMENSIONLESS)):
                values = [getattr(found, field) for found in windows]
                columns[f"{field}_{when}"] = ("window", values, of)
    return Dataset(columns)


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
            **source.sensitivities[name]._asdict(),
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
    numbers = ("typical", "smallest", "limit", "snr", "score", "side", "gain", "p_value")
    numbers += ("coefficient",)
    columns = {key: ("effect", [row.get(key, np.nan) for row in rows]) for key in numbers}
    status = ("effect", [str(row["status"]) for row in rows])
    units = ("effect", [source.units[name] for name in names])
    return Dataset({**columns, "unit": units, "status": status}, coords={"effect": names})


def _status(
    candidate: "inference.criticism.Candidate", source: "inference.criticism.Criticism"
) -> EffectStatus:
    from ..inference.criticism.verdict import MIN_GAIN

    if candidate.names[0] in source.verdict.effects:
        named = source.verdict.kind == VerdictKind.EFFECT
        return EffectStatus.NAMED if named else EffectStatus.POSSIBLE
    if not candidate.passes:
        explains = candidate.gain > MIN_GAIN
        return EffectStatus.STILL_DIFFERS if explains else EffectStatus.GAINS_NOTHING
    if candidate.names in source.refuted:
        return EffectStatus.REFUTED
    if not candidate.refitted:
        return EffectStatus.NOT_REFITTED
    return EffectStatus.LESS_LIKELY


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
