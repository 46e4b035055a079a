"""criticism.nc and the section "criticise" of summary.json.

Groups of criticism.nc, under `stirs` and, where pours were given, under `pours`:

- `residual`: over the data's own dimensions, `observed`, and with `_before` and `_after` the
  expectation of the base and of the extended model, and the sd of observed less expected;
- `where`: over windows, their labels, and RMS, z and p-value before and after;
- `effects`: over effects, what was found out about each;
- `confusion`: cosines between the effects' signatures;
- `held_out`: over explanations and recordings, the gap before and after;
- `suggestions`: over further experiments, how well each would separate the explanations.

`posterior` holds the draws of the extended model, or of the base model where there is none.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from .results import PLANE_NAMES

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from . import inference
    from .calibration import Calibration
    from .clean_recordings import Clean
    from .pour_table import PourTable
    from .recordings import Recording
    from .settings import CriticismSettings
    from .stirring import Stirring

SURE = 0.05  # p-value of a window that is listed
QUANTILES = {"q05": 0.05, "q50": 0.5, "q95": 0.95}


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
    clean: "list[Clean]"

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


def criticism_tree(findings: Findings) -> "DataTree":
    """Everything that a report shows."""
    from xarray import DataTree

    settings = findings.settings
    sampled = findings.extended.fit.sample("nuts", chains=4, draws=1000, seed=settings.seed)
    groups: dict[str, Any] = {"/posterior": sampled["posterior"].to_dataset()}
    for name, source in findings.sources.items():
        groups[f"/{name}/residual"] = _residual(findings, name, source)
        groups[f"/{name}/where"] = _where(source)
        groups[f"/{name}/effects"] = _effects(source)
        groups[f"/{name}/confusion"] = _confusion(source)
        if source.gaps:
            groups[f"/{name}/held_out"] = _held_out(source)
        if source.suggestions:
            groups[f"/{name}/suggestions"] = _suggestions(source)
    tree = DataTree.from_dict(groups)
    tree.attrs.update(
        version=version("bolfi-liquids"),
        seed=settings.seed,
        baseline=[recording.path.name for recording in findings.baseline],
        baseline_sha256=[recording.hash for recording in findings.baseline],
        accepted=list(findings.accepted),
        accepted_by="user" if settings.accept else "verdict",
        liquid_density=findings.calibration.liquid_density,
    )
    return tree


def _residual(findings: Findings, name: str, source: "inference.Criticism") -> "Dataset":
    from xarray import Dataset

    observed = source.base.hypothesis.fit.observed
    if name == "stirs":
        dims = ("frame", "plane")
        time = findings.stirring.time
        coords = {
            "time": ("frame", time, {"units": "s"}),
            "recording": ("frame", findings.stirring.member),
            "plane": list(PLANE_NAMES),
        }
    else:
        table = findings.table
        assert table is not None
        dims = ("outcome", "pour")
        coords = {
            "angular_velocity": ("pour", table.angular_velocity, {"units": "rad s-1"}),
            "distance": ("pour", table.distance, {"units": "m"}),
            "outcome": ["spilled", "retained"],
        }
    columns = {"observed": (dims, observed)}
    models = {"before": source.base.hypothesis, "after": source.extended}
    for when, hypothesis in models.items():
        if hypothesis is not None:
            expected, sd = _expected(hypothesis)
            columns |= {f"expected_{when}": (dims, expected), f"sd_{when}": (dims, sd)}
    return Dataset(columns, coords=coords)


def _expected(hypothesis: "inference.Hypothesis") -> tuple[np.ndarray, np.ndarray]:
    output = hypothesis.surrogate.output
    sd = np.sqrt(np.diag(hypothesis.spread + hypothesis.noise))
    residual, sd = (output.restore(row[None])[0] for row in (hypothesis.difference, sd))
    return hypothesis.fit.observed - residual, sd


def _where(source: "inference.Criticism") -> "Dataset":
    from xarray import Dataset

    keys = {key: type(value) for found in source.before for key, value in found.label.items()}
    columns: dict[str, Any] = {
        key: ("window", [found.label.get(key, _NOTHING[kind]) for found in source.before])
        for key, kind in keys.items()
    }
    for when, windows in (("before", source.before), ("after", source.after)):
        if windows:
            for field in ("rms", "z", "p_value"):
                values = [getattr(found, field) for found in windows]
                columns[f"{field}_{when}"] = ("window", values)
    return Dataset(columns)


_NOTHING: dict[type, Any] = {str: "", int: -1, float: float("nan")}


def _effects(source: "inference.Criticism") -> "Dataset":
    from xarray import Dataset

    signatures, singles = source.base.signatures, source.singles
    names = [*signatures, *source.untested]

    def of(name: str) -> dict[str, Any]:
        if name not in signatures:
            return {"status": "untested: its simulations failed"}
        found = {
            "typical": signatures[name].coefficient,
            "snr": signatures[name].snr,
            "score": source.base.check.scores.get(name, 0.0),
        }
        candidate = singles.get(name)
        if candidate is None:
            return {**found, "status": "not needed"}
        status = "accepted" if candidate.accepted else "rejected"
        return {
            **found,
            "gain": candidate.gain,
            "p_value": candidate.check.p_value,
            "coefficient": candidate.hypothesis.best[name],
            "status": status if candidate.refitted else f"{status}, untested by a refit",
        }

    rows = [of(name) for name in names]
    numbers = ("typical", "snr", "score", "gain", "p_value", "coefficient")
    columns = {key: ("effect", [row.get(key, np.nan) for row in rows]) for key in numbers}
    status = ("effect", [row["status"] for row in rows])
    return Dataset({**columns, "status": status}, coords={"effect": names})


def _confusion(source: "inference.Criticism") -> "Dataset":
    from xarray import Dataset

    names = list(source.base.signatures)
    return Dataset(
        {"cosine": (("effect", "other"), source.confusion)},
        coords={"effect": names, "other": names},
    )


def _held_out(source: "inference.Criticism") -> "Dataset":
    from xarray import Dataset

    names = [" with ".join(explanation) for explanation in source.gaps]
    gaps = list(source.gaps.values())
    columns = {
        field: (
            ("explanation", "recording"),
            [[getattr(gap, field) for gap in row] for row in gaps],
        )
        for field in ("before", "after", "noise", "floor", "lpd_gain", "passes")
    }
    labels = [gap.label for gap in gaps[0]]
    return Dataset(columns, coords={"explanation": names, "recording": labels})


def _suggestions(source: "inference.Criticism") -> "Dataset":
    from xarray import Dataset

    return Dataset(
        {
            "snr": ("experiment", [one.snr for one in source.suggestions]),
            "between": ("experiment", [" or ".join(one.between) for one in source.suggestions]),
        },
        coords={"experiment": [one.label for one in source.suggestions]},
    )


def criticism_section(findings: Findings, tree: "DataTree", seconds: float) -> dict[str, Any]:
    """Numbers of a criticism, in the design's form."""
    stirs = findings.stirs
    posterior = tree["posterior"].to_dataset()
    kind, effects = _together(findings)
    best = findings.extended.best
    return {
        "verdict": kind,
        "effects": list(effects),
        "accepted": list(findings.accepted),
        "accepted_by": tree.attrs["accepted_by"],
        "reason": " ".join(source.verdict.reason for source in findings.sources.values()),
        "p_value": min(source.verdict.p_value for source in findings.sources.values()),
        "where": _sure(stirs),
        "coefficient": {name: _interval(posterior[name].to_numpy()) for name in findings.accepted},
        "parameters": {
            str(name): _interval(values.to_numpy()) for name, values in posterior.items()
        },
        "best": best,
        "n_simulations": sum(source.simulations for source in findings.sources.values())
        + _clean_runs(findings),
        "gap_deg": _gap_deg(stirs),
        "pours": None if findings.pours is None else _pour_gap(findings.pours),
        "suggestions": [
            {"experiment": one.label, "between": list(one.between), "snr": one.snr}
            for source in findings.sources.values()
            for one in source.suggestions
        ],
        "untested": [name for source in findings.sources.values() for name in source.untested],
        "baseline": len(findings.baseline),
        "noise": _noise(findings),
        "seconds": seconds,
        "seed": findings.settings.seed,
        "version": version("bolfi-liquids"),
    }


def _together(findings: Findings) -> tuple[str, tuple[str, ...]]:
    """One verdict on all data: what was named anywhere, or else the gravest."""
    verdicts = [source.verdict for source in findings.sources.values()]
    for kind in ("effect", "tie", "unknown"):
        named = [verdict for verdict in verdicts if verdict.kind == kind]
        if named:
            return kind, tuple(name for verdict in named for name in verdict.effects)
    return "none", ()


def _sure(source: "inference.Criticism") -> list[dict[str, Any]]:
    """The windows in which the base model and the data surely differ, surest first."""
    sure = [found for found in source.before if found.p_value < SURE]
    ordered = sorted(sure, key=lambda found: (found.p_value, -abs(found.z)))
    return [
        {**found.label, "rms_deg": float(np.degrees(found.rms)), "p_value": found.p_value}
        for found in ordered
    ]


def _interval(draws: np.ndarray) -> dict[str, float]:
    quantiles = {name: float(np.quantile(draws, q)) for name, q in QUANTILES.items()}
    return {"mean": float(draws.mean()), "sd": float(draws.std(ddof=1)), **quantiles}


def _rms(hypothesis: "inference.Hypothesis | None") -> float | None:
    return None if hypothesis is None else float(np.sqrt(np.mean(hypothesis.difference**2)))


def _degrees(value: float | None) -> float | None:
    return None if value is None else float(np.degrees(value))


def _gap_deg(source: "inference.Criticism") -> dict[str, float | None]:
    """The gap before and after, by what was accepted or else by the best of what is tied.

    A gap is the RMS of observed less expected beyond what the cameras and the simulator's own
    noise would leave of a right model, in quadrature; the RMS itself stands beside it.
    """
    best = source.leading
    base = source.base.hypothesis
    own = np.diag(base.spread) + np.diag(source.measurement)
    gaps = () if best is None else source.gaps.get(best.names, ())

    def pooled(values: list[float]) -> float | None:
        return float(np.sqrt(np.mean(np.square(values)))) if values else None

    after = None if best is None else _rms(best.hypothesis)
    noise = float(np.sqrt(np.mean(own)))
    numbers = {
        "before": _beyond(_rms(base), noise),
        "after": _beyond(after, noise),
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


def _beyond(rms: float | None, noise: float) -> float | None:
    return None if rms is None else max(rms**2 - noise**2, 0.0) ** 0.5


def _pour_gap(source: "inference.Criticism") -> dict[str, Any]:
    """RMS of the spilled and retained fractions, and the verdict on the pours alone."""
    best = source.leading
    return {
        "before": _rms(source.base.hypothesis),
        "after": _rms(None if best is None else best.hypothesis),
        "verdict": source.verdict.kind,
        "effects": list(source.verdict.effects),
        "p_value": source.verdict.p_value,
    }


def _clean_runs(findings: Findings) -> int:
    plan = findings.settings.clean_plan
    return len(findings.baseline) * (plan.start + plan.base)


def _noise(findings: Findings) -> Mapping[str, float]:
    """The cameras' noise as it was learned, and how well."""
    from .stir_experiment import camera_noise

    noise = camera_noise(findings.stirring.recordings)
    return {
        "sd_deg": float(np.degrees(noise.sd.mean())),
        "sd_uncertainty": float(noise.sd.std() / noise.sd.mean()),
        "correlation": float(noise.correlation.mean()),
        "samples": noise.samples,
    }
