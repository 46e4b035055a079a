"""The report of a comparison in Markdown, as the site's page: medians over seeds, paired tests."""

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from machine import machine
from scipy.stats import wilcoxon
from tasks import TASKS

OURS = "signal"  # the default surrogate: the one that is compared with each peer
LEVEL = 0.05  # of all tests against a peer together
COLUMNS = {"total_variation": ("TV", 2), "mean_error": ("mean", 2), "sd_ratio": ("sd", 2)} | {
    "coverage": ("coverage", 2),
    "engine_s": ("CPU s", 1),
}
TITLE = "# How does the engine compare with ELFI, sbi, PyVBMC and surmise?\n"
ABOUT = """
Every engine has the same simulator, prior, data and number N of simulations, a process of its own
and one processor. `signal` and `discrepancy` are this engine's two surrogates: `signal` is
`inference.fit` with its default arguments, with `noise=` where a task has noise of a known
covariance (else `noise=0`: the simulator makes all noise), and with `confirm=0`, for runs that
confirm come beyond N. `elfi` is ELFI's BOLFI on the logarithm of the task's discrepancy. `npe` and
`nle` are sbi's, one round on draws of the prior; they see simulations with the noise. `vbmc` is
PyVBMC with the exact log likelihood, N times, and `vbmc_noisy` the same with a normal error of sd
1; both only where a run tells the likelihood, for the noise's covariance is known. `surmise` is its
emulator PCGPwM on a Latin hypercube, with its Bayesian calibrator, where five or more outputs have
such noise. All peers run with their defaults.

Exact posteriors come from grids, or from importance sampling where no grid resolves them. TV is
total variation between an engine's density and the exact one, 0 if equal, 1 if disjoint. Seeds are
those of the engine, and of the data where these are not real (`ball_drop`, `boarding_school`). A
run that failed has TV 1, and enters no other median.
"""
REPEAT = """
## Repeat it

```
make peers
.venv/bin/python tests/benchmarks/compare.py --out runs/compare
.venv/bin/python tests/benchmarks/compare.py --out runs/compare --page {page}
```

An interrupted comparison goes on where it stopped.
"""
PAGE = "bolfi_liquids/guide/benchmark.md"


class Paired(NamedTuple):
    """`OURS` and a peer on a task at a budget.

    Attributes:
        gain: Median over seeds of the peer's TV less ours.
        p: Of Wilcoxon's signed-rank test over seeds, by Holm's correction for all of the peer's.
    """

    gain: float
    p: float

    @property
    def sure(self) -> bool:
        return self.p < LEVEL


def report(rows: list[dict]) -> str:
    """Markdown of the rows of results."""
    made = [row for row in rows if row["kind"] == "posterior"]
    posterior = [row for row in made if row.get("simulations", 0) <= row["n"]]
    if not posterior:
        return "no results yet"
    cells = sorted({(r["task"], r["n"]) for r in posterior}, key=order)
    engines = [e for e in dict.fromkeys(r["engine"] for r in posterior)]
    tests = {e: paired(posterior, e, cells) for e in engines if e != OURS}
    parts = [
        TITLE,
        heading(rows),
        ABOUT,
        "## Total variation\n",
        f"Medians over seeds. In bold: smaller than `{OURS}`'s. \\*: the difference over seeds is "
        f"significant at {LEVEL}.\n",
        *variation_table(posterior, engines, cells, tests),
        "\n## Against each peer\n",
        "Cells are a task at an N, on the seeds that both have. Wilcoxon's signed-rank test of TV, "
        "corrected by Holm for all cells of a peer. With fewer than ten seeds hardly any "
        "difference can be significant.\n",
        *summary_table(tests),
        "\n## All scores\n",
        "mean: error of the mean in exact sds, root mean square over parameters. sd: over the "
        "exact one, geometric mean over parameters. coverage: exact probability of the 90 % "
        "intervals, mean over parameters. CPU s: of the engine, without simulator. Medians.\n",
        *scores_table(posterior, engines, cells),
        *failures(posterior),
        *left_out(row for row in made if row not in posterior),
        *timings(rows),
        REPEAT.format(page=PAGE),
    ]
    return "\n".join(parts)


def order(cell: tuple[str, int]) -> tuple[int, int]:
    return list(TASKS).index(cell[0]), cell[1]


def of(rows: list[dict], engine: str, cell: tuple[str, int]) -> list[dict]:
    return [r for r in rows if r["engine"] == engine and (r["task"], r["n"]) == cell]


def paired(rows: list[dict], peer: str, cells: Sequence[tuple[str, int]]) -> dict:
    """Cell -> `Paired`, where both engines have seeds in common."""
    found = {}
    for cell in cells:
        ours, theirs = (
            {r["seed"]: r.get("total_variation", 1.0) for r in of(rows, engine, cell)}
            for engine in (OURS, peer)
        )
        gains = np.array([theirs[seed] - ours[seed] for seed in ours.keys() & theirs.keys()])
        if len(gains):
            p = wilcoxon(gains)[1] if gains.any() else 1.0
            found[cell] = Paired(float(np.median(gains)), float(p))
    corrected = holm([one.p for one in found.values()])
    return {c: one._replace(p=p) for (c, one), p in zip(found.items(), corrected, strict=True)}


def holm(p: Sequence[float]) -> np.ndarray:
    """Holm's step-down correction (Scandinavian Journal of Statistics 6:65, 1979)."""
    ranks = np.argsort(p)
    stepped = np.maximum.accumulate(np.sort(p) * np.arange(len(p), 0, -1))
    corrected = np.empty(len(p))
    corrected[ranks] = np.minimum(stepped, 1.0)
    return corrected


def table(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    rule = ["---"] * len(head)
    return [f"| {' | '.join(row)} |" for row in (head, rule, *body)]


def variation_table(rows, engines, cells, tests) -> list[str]:
    body = []
    for cell in cells:
        own = median(of(rows, OURS, cell), "total_variation")
        shown_cells = []
        for engine in engines:
            value = median(of(rows, engine, cell), "total_variation")
            test = tests.get(engine, {}).get(cell)
            text = shown(value, 2) + ("\\*" if test is not None and test.sure else "")
            shown_cells.append(f"**{text}**" if value < own else text)
        body.append([cell[0], str(cell[1]), *shown_cells])
    return table(["task", "N", *engines], body)


def summary_table(tests: dict[str, dict]) -> list[str]:
    body = []
    for peer, cells in tests.items():
        counts = [
            str(sum(sign * one.gain > 0.0 and (one.sure or not sure) for one in cells.values()))
            for sign, sure in product((1, -1), (False, True))
        ]
        body.append([peer, str(len(cells)), *counts])
    return table(["peer", "cells", "we win", "significantly", "we lose", "significantly"], body)


def scores_table(rows, engines, cells) -> list[str]:
    body = []
    for cell, engine in product(cells, engines):
        if own := of(rows, engine, cell):
            values = [shown(median(own, key), digits) for key, (_, digits) in COLUMNS.items()]
            seeds = str(len({row["seed"] for row in own}))
            body.append([cell[0], str(cell[1]), engine, seeds, *values])
    return table(["task", "N", "engine", "seeds", *(name for name, _ in COLUMNS.values())], body)


def failures(rows: list[dict]) -> list[str]:
    """What has no posterior, or stopped in NUTS."""
    what = {"error": "has no posterior", "nuts_error": "stopped in NUTS"}
    seeds: dict[tuple, list[str]] = {}
    for name, row in product(what, rows):
        if name in row:
            case = row["engine"], what[name], row["task"], row["n"], row[name]
            seeds.setdefault(case, []).append(str(row["seed"]))
    return ["\n## Failures\n"] + [
        f"- `{engine}` {text} on {task} at N = {n}, seeds {', '.join(found)}: {reason}"
        for (engine, text, task, n, reason), found in seeds.items()
    ]


def left_out(rows: Iterable[dict]) -> list[str]:
    """What made more simulations than it was to."""
    counts = {(r["engine"], r["task"], r["n"]): r["simulations"] for r in rows}
    return [
        f"- `{engine}` is left out on {task} at N = {n}: it made {made} simulations"
        for (engine, task, n), made in counts.items()
    ]


def timings(rows: list[dict]) -> list[str]:
    """Imports, single steps, compilations, cold runs and NUTS, where they were timed."""
    lines = ["\n## Seconds beside those of the table\n"]
    for engine in dict.fromkeys(row["engine"] for row in rows):
        own = [row for row in rows if row["engine"] == engine]
        text = f"- `{engine}`: imports {shown(median(own, 'import_s'), 1)} s"
        for n in sorted({row["n"] for row in own}):
            here = [row for row in own if row["n"] == n]
            fresh = [row for row in here if row.get("fresh")]
            measured = {
                "cold run {} s": shown(median(fresh, "first_engine_s"), 1),
                "4 x 1000 draws of NUTS {} s": shown(median(here, "nuts_s"), 1),
                "one ask and tell {} s": shown(median(here, "step_s"), 3),
                "{} programs compiled until then": shown(median(here, "compilations"), 0),
            }
            said = [words.format(value) for words, value in measured.items() if value]
            text += f"; at N = {n} {', '.join(said)}" if said else ""
        lines.append(text)
    return lines


def median(rows: list[dict], name: str) -> float:
    """Of those that have it; NaN where none does. A run without posterior has TV 1."""
    worst = {"total_variation": 1.0}.get(name)
    values = [row.get(name, worst) if "error" in row else row.get(name) for row in rows]
    values = [value for value in values if value is not None]
    return float(np.median(values)) if values else float("nan")


def shown(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def heading(rows: list[dict]) -> str:
    versions = ", ".join(dict.fromkeys(f"{row['engine']}: {row['version']}" for row in rows))
    return f"{machine()}. {versions}. {len({row['seed'] for row in rows})} seeds at most.\n"
