"""The report of a comparison in Markdown, as the site's page: medians over seeds, paired tests."""

from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from cells import admitted, cells_of, engines_of, median, needed, of, scores
from machine import machine
from scipy.stats import wilcoxon
from summary import OURS, OWN, TIE, summary
from tasks import TASKS

from bolfi_liquids.drawing import new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVEL = 0.05  # of all tests against a peer together
ABOUT = {  # kept apart from the tasks: a change in their files would make all results stale
    "gauss2": ("mean of 20 draws of two correlated normals", "ours"),
    "ma2": ("moving average of order 2, in 100 steps", "ours"),
    "pend2": ("drags of a driven pendulum with process noise", "ours"),
    "pendobs": ("drags of a pendulum that is measured with error", "ours"),
    "pendobs3": ("the same, and its stiffness", "ours"),
    "two_moons": ("two crescents", "sbibm T.8"),
    "gaussian_mixture": ("common mean of a wide and a narrow normal", "sbibm T.7"),
    "sir": ("an epidemic among a million, counted with error", "sbibm T.9"),
    "lotka_volterra": ("predators and prey", "sbibm T.10"),
    "slcp": ("mean and covariance of four points; four modes", "sbibm T.3"),
    "ball_drop": ("drag and gravity of a falling ball", "SEPIA, real data"),
    "boarding_school": ("an epidemic among 763 pupils", "BMJ 1:587, 1978, real data"),
}
TITLE = "# How does the engine compare with ELFI, sbi, PyVBMC and surmise?\n"
PREFACE = """
`signal` and `discrepancy` are this engine's two surrogates. A score is the total variation (TV)
between a posterior and the exact one, 0 if equal, 1 if disjoint, median over {seeds} seeds at most.
A cell is a task at a number N of simulations. Differences below {tie} are ties.
"""
RULES = """
## What is compared

Every engine has the same simulator, prior, data and N, a process of its own and one processor.
`signal` is `inference.fit` with its default arguments, with `noise=` where a task has noise of a
known covariance (else `noise=0`: the simulator makes all noise), and with `confirm=0`, for runs
that confirm come beyond N. `elfi` is ELFI's BOLFI on the logarithm of the task's discrepancy. `npe`
and `nle` are sbi's, one round on draws of the prior; they see simulations with the noise. `vbmc` is
PyVBMC with the exact log likelihood, N times, and `vbmc_noisy` the same with a normal error of sd
1; both only where a run tells the likelihood, for the noise's covariance is known. `surmise` is its
emulator PCGPwM on a Latin hypercube, with its Bayesian calibrator, where five or more outputs have
such noise. All peers run with their defaults.

Exact posteriors come from grids, or from importance sampling where no grid resolves them. Seeds are
those of the engine, and of the data where these are not real. A run that failed has TV 1.
sbibm: Lueckmann et al. 2021, arXiv:2101.04653.
"""
REPEAT = """
## Repeat it

```
make peers
.venv/bin/python tests/benchmarks/compare.py --out runs/compare
.venv/bin/python tests/benchmarks/compare.py --out runs/compare --page {page}
```

An interrupted comparison goes on where it stopped. [All scores]({scores}), with errors of mean and
sd, coverage and CPU seconds, are a table.
"""
PAGE = "bolfi_liquids/guide/benchmark.md"


class Paired(NamedTuple):
    """`OURS` and a peer on a task at a budget.

    Attributes:
        gain: Median over seeds of the peer's TV less ours.
        p: Of Wilcoxon's signed-rank test over seeds, by Holm's correction for all of the peer's.
        seeds: Number of pairs.
    """

    gain: float
    p: float
    seeds: int

    @property
    def sure(self) -> bool:
        return self.p < LEVEL


def write_page(rows: list[dict], page: Path) -> None:
    """The report, and beside it a table of all scores and the figure that it shows."""
    page.write_text(report(rows, page.stem), encoding="utf-8")
    posterior, _ = admitted(rows)
    scores(posterior).to_csv(page.with_suffix(".csv"), index=False, float_format="%.4g")
    with styled():
        draw(posterior).savefig(page.with_suffix(".png"), dpi=100)


def report(rows: list[dict], name: str = "benchmark") -> str:
    """Markdown of the rows of results."""
    posterior, too_many = admitted(rows)
    if not posterior:
        return "no results yet"
    cells, engines = cells_of(posterior), engines_of(posterior)
    tests = {e: paired(posterior, e, cells) for e in engines if e != OURS}
    seeds = len({row["seed"] for row in rows})
    marked = " \\*: significant by the tests below."
    parts = [
        TITLE + PREFACE.format(seeds=seeds, tie=TIE),
        *summary(posterior),
        f"\n![Median TV against N, a panel for each task and a line for each engine]({name}.png)",
        "\n## Tasks\n",
        *task_table(cells),
        RULES,
        "## Total variation\n",
        f"In bold: below `{OURS}`'s, ties apart.{marked * testable(tests)}\n",
        *variation_table(posterior, engines, cells, tests),
        "\n## Against each peer\n",
        *peer_table(tests),
        "",
        *left_out(too_many),
        *failures(posterior),
        *timings(rows),
        REPEAT.format(page=PAGE, scores=f"{name}.csv"),
        versions(rows),
    ]
    return "\n".join(parts)


def task_table(cells: Sequence[tuple[str, int]]) -> list[str]:
    """Of the tasks of these cells; outputs are those that `OURS` is given."""
    body = []
    for name in dict.fromkeys(task for task, _ in cells):
        task, (what, source) = TASKS[name], ABOUT[name]
        outputs = task.view(task.observe(0)[None]).size
        noise = "simulator" if task.noise is None else "data, known covariance"
        body.append([name, what, str(len(task.names)), str(outputs), noise, source])
    return table(["task", "what", "d", "m", "noise of", "source"], body) + [
        "\nd parameters, m outputs."
    ]


def draw(rows: list[dict]) -> "Figure":
    """Median TV against N: a panel for each task, a line for each engine."""
    medians = scores(rows)
    tasks, numbers = medians["task"].unique(), sorted(medians["n"].unique())
    height = -(-len(tasks) // 3)
    figure = new_figure(8.0, 1.8 * height + 0.5)
    panels = figure.subplots(height, 3, sharex=True, sharey=True, squeeze=False)
    for panel in panels.flat[len(tasks) :]:
        panel.set_axis_off()
    for panel, task in zip(panels.flat, tasks, strict=False):
        panel.set_title(task)
        for i, engine in enumerate(engines_of(rows)):
            own = medians[(medians["task"] == task) & (medians["engine"] == engine)]
            width = 2.5 if engine == OURS else 1.0
            panel.plot(own["n"], own["total_variation"], f"C{i}.-", lw=width, label=engine)
    first = panels[0, 0]  # whose axes all share
    first.set(xscale="log", ylim=(-0.02, 1.02))
    first.set_xticks(numbers, map(str, numbers))
    first.minorticks_off()
    figure.supxlabel("N")
    figure.supylabel("total variation from the exact posterior")
    figure.legend(*first.get_legend_handles_labels(), loc="outside upper center", ncols=8)
    return figure


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
            found[cell] = Paired(float(np.median(gains)), float(p), len(gains))
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


def testable(tests: dict[str, dict]) -> bool:
    """Whether the least p that some peer's pairs can give is significant."""
    seeds = {peer: max((one.seeds for one in of.values()), default=0) for peer, of in tests.items()}
    return any(len(tests[peer]) * 2.0 ** (1 - n) < LEVEL for peer, n in seeds.items())


def variation_table(rows, engines, cells, tests) -> list[str]:
    body = []
    for cell in cells:
        own = median(of(rows, OURS, cell), "total_variation")
        shown_cells = []
        for engine in engines:
            value = median(of(rows, engine, cell), "total_variation")
            test = tests.get(engine, {}).get(cell)
            text = shown(value, 2) + ("\\*" if test is not None and test.sure else "")
            shown_cells.append(f"**{text}**" if value < own - TIE else text)
        body.append([f"{cell[0]} {cell[1]}", *shown_cells])
    return table(["task, N", *engines], body)


def peer_table(tests: dict[str, dict]) -> list[str]:
    """How often `OURS` is closer than each peer, and than our other surrogate below the table."""
    sure = testable(tests)
    counts = {engine: compared(list(cells.values()), sure) for engine, cells in tests.items()}
    head = ["peer", "cells", "closer", "tied", "farther"]
    note = f"How often `{OURS}` is closer to the exact posterior, on the seeds that both have."
    if sure:
        head += ["surely closer", "surely farther"]
        note += f" Surely: by Wilcoxon's signed-rank test at {LEVEL}, with Holm's correction."
    lines = [f"{note}\n", *table(head, [[e, *map(str, counts[e])] for e in counts if e not in OWN])]
    for other in (e for e in counts if e in OWN):
        total, closer, tied, farther = counts[other][:4]
        lines.append(
            f"\nThan our own `{other}`, `{OURS}` is closer in {closer} of {total} cells, tied in "
            f"{tied} and farther in {farther}."
        )
    return lines


def compared(cells: list[Paired], sure: bool) -> list[int]:
    """Numbers of cells: all, closer, tied, farther, and `sure` ones that are closer, farther."""
    signs = [int(np.sign(one.gain)) * (abs(one.gain) >= TIE) for one in cells]
    found = [len(cells), *(signs.count(sign) for sign in (1, 0, -1))]
    gains = [one.gain for one in cells if one.sure]
    return found + ([sum(g > 0 for g in gains), sum(g < 0 for g in gains)] if sure else [])


def failures(rows: list[dict]) -> list[str]:
    """What has no posterior, or stopped in NUTS."""
    what = {"error": "has no posterior", "nuts_error": "stopped in NUTS"}
    cases: dict[tuple, dict] = {}  # of dictionaries in the place of ordered sets
    for name, row in product(what, rows):
        if name in row:
            case = row["engine"], what[name], row["task"], row[name]
            cases.setdefault(case, {})[f"N = {row['n']}, seed {row['seed']}"] = None
    return [
        f"- `{engine}` {text} on {task} at {'; '.join(found)}: {reason}"
        for (engine, text, task, reason), found in cases.items()
    ]


def left_out(rows: Iterable[dict]) -> list[str]:
    """Engines that cannot start, or end, with N simulations."""
    cases: dict[tuple, dict] = {}
    for row in sorted(rows, key=lambda row: row["n"]):
        cases.setdefault((row["engine"], row["task"], needed(row)), {})[str(row["n"])] = None
    return [
        f"- `{engine}` is left out on {task} at N = {', '.join(budgets)}: it needs {simulations} "
        "simulations"
        for (engine, task, simulations), budgets in cases.items()
    ]


def timings(rows: list[dict]) -> list[str]:
    """Imports, single steps, compilations, cold runs and NUTS, where they were timed."""
    lines = ["\n## Seconds\n"]
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


def shown(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def versions(rows: list[dict]) -> str:
    found = {row["engine"]: row["version"] for row in rows}
    return f"{machine()}. {', '.join(f'{e}: {version}' for e, version in found.items())}.\n"
