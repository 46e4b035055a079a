"""Writes the guide's page `accuracy` from what was measured.

    .venv/bin/python tests/benchmarks/accuracy_page.py RECORD...

A RECORD is a file that `make physics` or `make against` left, of pours in cells of any width, or
calibrations.json of calibrate_references.py. Those of a kind replace all that was kept of it in
tests/data/accuracy.json, from which the page is written by accuracy.md.jinja: give the records of a
whole run. Without a RECORD the page is written again.
"""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from against import neighbours, pour_bars
from bolfi_liquids.models.accuracy import LARGEST_ERRORS
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from machine import processor

ROOT = Path(__file__).parents[2]
MEASURED = ROOT / "tests" / "data" / "accuracy.json"
PAGE = ROOT / "bolfi_liquids" / "guide" / "accuracy.md"
TEMPLATE = "accuracy.md.jinja"
DIGITS = 4  # that are kept of each figure
KINDS = ("physics", "stirs", "pours", "calibrations")
PERCENT = "relative"  # unit of a case whose errors are fractions of the truth

Record = Mapping[str, Any]


def kept(records: Iterable[Record]) -> dict[str, Any]:
    """What the page needs of records, by kind.

    Raises:
        ValueError: Those of a kind are of several models, or one is no record.
    """
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        kind = PARTS.get(str(record.get("kind")))
        if kind is None:
            raise ValueError(f"no record of a kind of {', '.join(PARTS)}: {str(record):.80}")
        width = f"{record['cell_mm']:.3g}" if kind == "pours" else ""
        groups.setdefault((kind, width), []).append(record)
    found: dict[str, Any] = {}
    for (kind, width), group in groups.items():
        part = {**_rounded(COLLECTED[kind](group)), "made": _made(kind, group)}
        if kind == "pours":
            found.setdefault(kind, {})[width] = part
        else:
            found[kind] = part
    return found


def _made(kind: str, group: Iterable[Record]) -> dict[str, str]:
    """The model of all records, and when and where they were made."""
    models = {str(record["model"]) for record in group}
    if len(models) > 1:
        raise ValueError(f"{kind} of the models {', '.join(sorted(models))}: repeat the older ones")
    day = max(str(record["created"]) for record in group)
    return {"model": models.pop(), "on": f"{day}, {processor()}"}


def _cases(group: Iterable[Record]) -> dict[str, Any]:
    about = ("truth", "source", "unit", "rows")
    return {"cases": {one["name"]: _only(one, about) for one in group}}


def _stirs(group: Sequence[Record]) -> dict[str, Any]:
    stirs = {one["name"]: _replayed(one) for one in group if one["kind"] == "stir"}
    ratios = [one["rows"][0]["ours"] for one in group if one["kind"] == "neighbours"]
    return {"recordings": stirs, "ratios": ratios}


def _pours(group: Sequence[Record]) -> dict[str, Any]:
    about = ("liquid", "viscosity", "contact_angle_deg", "cpu_s", "excess", "rows")
    poured = [one for one in group if one["kind"] == "poured"]
    poured.sort(key=lambda one: (one["viscosity"], one["contact_angle_deg"]))
    liquids = {one["name"]: _only(one, about) for one in poured}
    across = [row for one in group if one["kind"] == "across" for row in one["rows"]]
    across.sort(key=lambda row: row["quantity"].startswith("shift"))  # means first
    return {"liquids": liquids, "across": across}


def _calibrations(group: Sequence[Record]) -> dict[str, Any]:
    return {"budget": group[-1]["budget"], "of": group[-1]["calibrations"]}


PARTS = {
    "case": "physics",
    "stir": "stirs",
    "neighbours": "stirs",
    "poured": "pours",
    "across": "pours",
    "calibrations": "calibrations",
}
"""Kind of a record -> part of the page."""
COLLECTED = {"physics": _cases, "stirs": _stirs, "pours": _pours, "calibrations": _calibrations}


def merged(measured: Record, found: Record) -> dict[str, Any]:
    """What was kept, with what is new in its place; pours of other cells stay."""
    pours = {**measured.get("pours", {}), **found.get("pours", {})}
    return {**measured, **found, **({"pours": pours} if pours else {})}


def page(measured: Record) -> str:
    """The page, from what is kept.

    Raises:
        ValueError: Something has not been measured, or not with the model of the rest.
    """
    _check_whole(measured)
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"span": span, "number": number}
    pours = measured["pours"]
    usual = max(pours, key=float)  # the simulator's own cells; others are finer
    return environment.get_template(TEMPLATE).render(
        any_viscosity=np.inf,
        stirs=_by_liquid(measured["stirs"]["recordings"]),
        ratios=sorted(measured["stirs"]["ratios"]),
        neighbour_bars=neighbours,
        rms_bars=LARGEST_ERRORS,
        calibrated=_by_liquid(measured["calibrations"]["of"]),
        budget=measured["calibrations"]["budget"],
        cases=measured["physics"]["cases"],
        rows_of=case_rows,
        cell=usual,
        pours=pours[usual]["liquids"],
        across=pours[usual]["across"],
        pour_bars=pour_bars,
        finer={width: one["across"] for width, one in pours.items() if width != usual},
        made=measured["physics"]["made"],
        timed=measured["stirs"]["made"],
        missed=missed(measured["physics"]["cases"], pours[usual], measured["stirs"]),
    )


def case_rows(case: Record) -> list[dict[str, str]]:
    """Comparisons of a case, those of one tolerance and unit together."""
    groups: dict[tuple[str, float], list[Record]] = {}
    for row in case["rows"]:
        groups.setdefault((_unit(case, row), row["tolerance"]), []).append(row)
    return [
        {
            "count": str(len(rows)),
            "errors": _with_unit(span([row["error"] for row in rows], unit == PERCENT), unit),
            "tolerance": _with_unit(number(tolerance, unit == PERCENT), unit),
            "farthest": _bare(max(rows, key=lambda row: abs(row["error"] or 0.0))["quantity"]),
        }
        for (unit, tolerance), rows in groups.items()
    ]


def missed(cases: Record, pours: Record, stirs: Record) -> list[str]:
    """What is out of its tolerance, in words."""
    rows: Iterable[tuple[str, Record]] = [
        *((name, row) for name, case in cases.items() for row in case["rows"]),
        *((name, row) for name, one in pours["liquids"].items() for row in one["rows"]),
        *(("pours", row) for row in pours["across"]),
    ]
    stirred = [name for name, one in stirs["recordings"].items() if not one["passed"]]
    beyond = [
        f"{name}: {row['quantity']}, {number(row['error'])} (bar {number(row['tolerance'])})"
        for name, row in rows
        if not row["passed"]
    ]
    return [*stirred, *beyond]


def number(value: float | None, percent: bool = False) -> str:
    """Two digits, or three above 100; as it is read."""
    if value is None:
        return "none"
    shown = 100.0 * value if percent else value
    text = f"{float(f'{shown:.2g}' if abs(shown) < 100.0 else f'{shown:.3g}'):g}"
    return "0" if text == "-0" else text


def span(values: Iterable[float | None], percent: bool = False) -> str:
    """The least and the largest, or one number where they read alike; "none" if one failed."""
    values = list(values)
    if None in values:
        return "none"
    ends = [number(end(values), percent) for end in (min, max)]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def _check_whole(measured: Record) -> None:
    """Refuse figures of several models on one page."""
    if lacking := [kind for kind in KINDS if not measured.get(kind)]:
        raise ValueError(f"nothing is kept of {', '.join(lacking)}; give these records, too")
    models = {kind: measured[kind]["made"]["model"] for kind in KINDS if kind != "pours"}
    for width, one in measured["pours"].items():
        models[f"pours in cells of {width} mm"] = one["made"]["model"]
    if len(set(models.values())) > 1:
        told = ", ".join(f"{kind} of model {model}" for kind, model in models.items())
        raise ValueError(f"{told}: measure all of them with one")


def _unit(case: Record, row: Record) -> str:
    """Of a row's error: the case's, or where it has none that in the quantity's brackets."""
    if case["unit"] or not row["quantity"].endswith("]"):
        return case["unit"]
    return row["quantity"].rpartition("[")[2].removesuffix("]")


def _with_unit(text: str, unit: str) -> str:
    shown = {PERCENT: "%", "fraction": "", "deg": "°"}.get(unit, unit)
    return f"{text} {shown}".strip()


def _bare(quantity: str) -> str:
    """Without its unit; a bar would end the cell of a table."""
    return quantity.partition(" [")[0].replace("|", "\\|")


def _by_liquid(by_name: Record) -> dict[tuple[str, float], list[Record]]:
    """(name of the liquid, viscosity) -> its recordings, from the thinnest to the thickest."""
    groups: dict[tuple[str, float], list[Record]] = {}
    for name, one in sorted(by_name.items(), key=lambda pair: (pair[1]["viscosity"], pair[0])):
        groups.setdefault((_liquid(name, one), one["viscosity"]), []).append(one)
    return groups


def _liquid(name: str, one: Record) -> str:
    """Of a recording: LIQUID_..., or hidden_LIQUID_... with the effects that act in it."""
    effects = ", ".join(f"`{effect}`" for effect in one.get("effects", ()))
    words = name.removeprefix("hidden_").split("_")
    return f"{words[0]} with {effects}" if effects else words[0]


def _replayed(record: Record) -> dict[str, Any]:
    rms, spread = record["rows"]
    return {
        **_only(record, ("viscosity", "effects", "cpu_s")),
        "rms": rms["ours"],
        "bar": rms["tolerance"],
        "spread": spread["ours"],
        "spread_bar": spread["tolerance"],
        "passed": rms["passed"] and spread["passed"],
    }


def _only(record: Record, names: Iterable[str]) -> dict[str, Any]:
    return {name: record[name] for name in names}


def _rounded(value: Any) -> Any:
    """Numbers of `DIGITS` digits, wherever they are."""
    if isinstance(value, Mapping):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_rounded(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def main(paths: Iterable[str]) -> None:
    measured = json.loads(MEASURED.read_text(encoding="utf-8")) if MEASURED.exists() else {}
    records = [json.loads(Path(path).read_text(encoding="utf-8")) for path in paths]
    try:
        measured = merged(measured, kept(records))
        text = page(measured)
    except ValueError as err:
        raise SystemExit(f"error: {err}") from err
    MEASURED.write_text(json.dumps(measured, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
