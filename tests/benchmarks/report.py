"""The table of a comparison: medians over seeds."""

import numpy as np
from machine import machine

COLUMNS = {  # title -> width and digits
    "TV": (5, 2),
    "/elfi": (6, 2),
    "mean": (6, 3),
    "sd": (5, 2),
    "warm s": (7, 2),
    "/elfi ": (6, 2),
    "cold s": (7, 2),
    "NUTS s": (7, 2),
    "cold s ": (7, 2),
}
LEGEND = """
TV: total variation to the exact posterior; mean: error of the mean in prior widths, root mean
square over parameters; sd: over the exact one, geometric mean over parameters; warm s: CPU seconds
of the engine without simulator and MCMC, of the second run in its process (peers compile nothing);
/elfi: over ELFI's; NUTS s: 4 x 1000 draws (of ELFI's, half are warm-up; ours warm up besides);
cold s: the same in a new process, imports not counted. Medians over seeds."""


def report(rows: list[dict]) -> str:
    posterior = [row for row in rows if row["kind"] == "posterior"]
    if not posterior:
        return "no results yet"
    lines = [heading(rows), head()]
    cells = sorted({(r["task"], r["n"]) for r in posterior}, key=first_seen(posterior))
    for task, n in cells:
        here = [r for r in posterior if (r["task"], r["n"]) == (task, n)]
        good = [r["engine"] for r in here if "error" not in r]
        lines += [line(here, engine) for engine in dict.fromkeys(good)]
    return "\n".join([*lines, LEGEND, *extras(rows)])


def first_seen(rows: list[dict]):
    order = list(dict.fromkeys(row["task"] for row in rows))
    return lambda cell: (order.index(cell[0]), cell[1])


def head() -> str:
    titles = (f"{title.strip():>{width}}" for title, (width, _) in COLUMNS.items())
    return " ".join([f"{'task':9} {'N':>4} {'engine':12} {'seeds':>5}", *titles])


def line(rows: list[dict], engine: str) -> str:
    """One engine at one task and budget."""
    own = [row for row in rows if row["engine"] == engine and "error" not in row]
    elfi = [row for row in rows if row["engine"] == "elfi" and "error" not in row]
    fresh = [row for row in own if row.get("fresh")]
    variation, warm = median(own, "total_variation"), median(own, "engine_s")
    values = [
        variation,
        variation / median(elfi, "total_variation"),
        median(own, "mean_error"),
        median(own, "sd_ratio"),
        warm,
        warm / median(elfi, "engine_s"),
        median(fresh, "first_engine_s"),
        median(own, "nuts_s"),
        median(fresh, "first_nuts_s"),
    ]
    cells = [
        f"{shown(value, digits):>{width}}"
        for value, (width, digits) in zip(values, COLUMNS.values(), strict=True)
    ]
    name = f"{own[0]['task']:9} {own[0]['n']:4d} {engine:12} {len({r['seed'] for r in own}):5d}"
    return " ".join([name, *cells])


def extras(rows: list[dict]) -> list[str]:
    """Imports, single steps, compilations, failures of NUTS."""
    lines = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        own = [row for row in rows if row["engine"] == engine]
        text = f"{engine}: imports take {shown(median(own, 'import_s'), 1)} s"
        steps = [row for row in own if row["kind"] == "steps"]
        for n in sorted({row["n"] for row in steps}):
            here = [row for row in steps if row["n"] == n]
            text += (
                f"; at N = {n} one ask and tell {1e3 * median(here, 'step_s'):.0f} ms, "
                f"{median(here, 'compilations'):.0f} programs compiled until then"
            )
        lines.append(text)
    parts = {"error": "has no posterior", "nuts_error": "stopped in NUTS"}
    return lines + [
        f"{row['engine']} {what} on {row['task']} at N = {row['n']}, seed {row['seed']} (left out "
        f"above): {row[name]}"
        for name, what in parts.items()
        for row in rows
        if name in row
    ]


def median(rows: list[dict], name: str) -> float:
    """Of those that have it; NaN where none does."""
    values = [row[name] for row in rows if name in row]
    return float(np.median(values)) if values else float("nan")


def shown(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def heading(rows: list[dict]) -> str:
    versions = ", ".join(dict.fromkeys(f"{row['engine']}: {row['version']}" for row in rows))
    return f"{machine()} ({versions})\n"
