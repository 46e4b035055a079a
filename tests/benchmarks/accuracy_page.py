"""Writes the guide's page `accuracy` from what was measured.

    .venv/bin/python tests/benchmarks/accuracy_page.py RECORD...

A RECORD is a results file: physics.json of `check physics`; against.json of `check physics
--against`, of stirs or of pours in cells of any width; calibrations.json of
calibrate_references.py. Each replaces what was kept of its kind in tests/data/accuracy.json, from
which the page is written by accuracy.md.jinja. Without a RECORD the page is written again. A file
of a few cases replaces all: give the results of a whole check.
"""

import json
import sys
from collections.abc import Iterable, Mapping
from datetime import date
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from machine import processor

ROOT = Path(__file__).parents[2]
MEASURED = ROOT / "tests" / "data" / "accuracy.json"
PAGE = ROOT / "bolfi_liquids" / "guide" / "accuracy.md"
TEMPLATE = "accuracy.md.jinja"
DIGITS = 4  # that are kept of each figure
KINDS = ("physics", "stirs", "pours", "calibrations")
PERCENT = "relative"  # unit of a case whose errors are fractions of the truth
RESULT = ("quantity", "truth", "ours", "error", "tolerance", "passed")

Record = Mapping[str, Any]


def kept(record: Record) -> dict[str, Any]:
    """What the page needs of a results file, by kind.

    Raises:
        ValueError: It is no results file, or holds no results.
    """
    found: dict[str, Any] = {}
    if cases := record.get("cases"):
        about = ("title", "truth", "source", "unit", "error")
        found["physics"] = {
            "cases": {
                name: {key: case[key] for key in about} | {"rows": _rows(case["rows"])}
                for name, case in cases.items()
            }
        }
    if recordings := record.get("recordings"):
        pairs = [_only(one, ("ratio", "judged", "passed")) for one in record["neighbours"]]
        bars = _only(record["settings"], ("max_ratio_difference", "least_judged_deg", "rms_bars"))
        found["stirs"] = {
            "recordings": {name: _replayed(one) for name, one in recordings.items()},
            "neighbours": pairs,
            "bars": bars,
        }
    if pours := record.get("pours"):
        width = next(iter(pours.values()))["settings"]["cups"]["numerics"]["cell"]
        found["pours"] = {
            f"{1e3 * width:.3g}": {
                "liquids": {name: _poured(one) for name, one in pours.items()},
                "across": _rows(record["across_pours"]),
                "bars": record["settings"]["pours"],
            }
        }
    if calibrations := record.get("calibrations"):
        found["calibrations"] = {"budget": record["budget"], "of": _rounded(calibrations)}
    if not found:
        raise ValueError(
            "holds none of cases, recordings, pours and calibrations; give physics.json, "
            "against.json or calibrations.json of a finished check"
        )
    for kind, one in found.items():
        day = str(record.get("created", date.today()))[:10]
        made = {"model": record.get("model"), "on": f"{day}, {processor()}"}
        for part in one.values() if kind == "pours" else (one,):
            part["made"] = made
    return found


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
        stirs=_by_liquid(measured["stirs"]["recordings"]),
        ratios=sorted(one["ratio"] for one in measured["stirs"]["neighbours"] if one["judged"]),
        bars=measured["stirs"]["bars"],
        calibrated=_by_liquid(measured["calibrations"]["of"]),
        budget=measured["calibrations"]["budget"],
        cases=measured["physics"]["cases"],
        rows_of=case_rows,
        cell=usual,
        pours=pours[usual]["liquids"],
        across=pours[usual]["across"],
        pour_bars=pours[usual]["bars"],
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
    failed = [f"{name}: {case['error']}" for name, case in cases.items() if case["error"]]
    stirred = [name for name, one in stirs["recordings"].items() if not one["passed"]]
    beyond = [
        f"{name}: {row['quantity']}, {number(row['error'])} (bar {number(row['tolerance'])})"
        for name, row in rows
        if not row["passed"]
    ]
    return [*failed, *stirred, *beyond]


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
        "viscosity": record["settings"]["viscosity"],
        "effects": sorted(record["settings"]["effects"]),
        "rms": _rounded(rms["ours"]),
        "bar": rms["tolerance"],
        "spread": _rounded(spread["ours"]),
        "spread_bar": spread["tolerance"],
        "cpu_s": record["notes"]["cpu_s"],
        "passed": record["passed"],
    }


def _poured(record: Record) -> dict[str, Any]:
    title, settings = record["title"], record["settings"]
    return {
        "liquid": title.partition(",")[0],
        "viscosity": settings["viscosity"],
        "contact_angle_deg": settings["cups"]["source"]["contact_angle_deg"],
        "cpu_s": record["notes"]["cpu_s"],
        "excess": [_rounded(one["excess"]) for one in record["notes"]["pours"]],
        "rows": _rows(record["rows"]),
    }


def _rows(rows: Iterable[Record]) -> list[dict[str, Any]]:
    return [_rounded(_only(row, RESULT)) for row in rows]


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
    for path in paths:
        try:
            measured = merged(measured, kept(json.loads(Path(path).read_text(encoding="utf-8"))))
        except ValueError as err:
            raise SystemExit(f"error: {path}: {err}") from err
    try:
        text = page(measured)
    except ValueError as err:
        raise SystemExit(f"error: {err}") from err
    MEASURED.write_text(json.dumps(measured, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
