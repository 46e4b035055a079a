"""What a comparison shows, in words."""

from collections.abc import Iterable

import numpy as np
from cells import at, cells_of, engines_of, median, of, order

OURS = "signal"  # the default surrogate: the one that is compared with each peer
OWN = (OURS, "discrepancy")
TIE = 0.01  # differences of TV below it
TOLD = ("vbmc", "vbmc_noisy")  # the likelihood
STALLED = 0.1  # share of TV that the last rise of N takes off, where it helps; TV that needs none
USELESS = 0.9  # TV from which a posterior tells next to nothing
HIGH = 0.5  # TV at which a posterior is of little use
COVERED = 0.8  # of 90 % intervals, at least


def summary(rows: list[dict]) -> list[str]:
    """What the cells show of `OURS`: where it is best, loses, stops, covers too little."""
    engines, cells = engines_of(rows), cells_of(rows)
    found = {(e, c): median(of(rows, e, c), "total_variation") for e in engines for c in cells}
    scored = {key: value for key, value in found.items() if not np.isnan(value)}
    ours = {cell: value for (e, cell), value in scored.items() if e == OURS}
    blind = {key: value for key, value in scored.items() if key[0] not in TOLD}
    met = {cell for e, cell in blind if e not in OWN} & ours.keys()
    told = {cell for e, cell in scored if e in TOLD} & ours.keys()
    lost = losses(blind, met)
    beaten = losses({k: value for k, value in scored.items() if k[0] in (OURS, *TOLD)}, told)
    useless = sum(ours[cell] > USELESS for cell in met - lost.keys())
    runs = {task: [ours[c] for c in cells if c[0] == task and c in ours] for task, _ in cells}
    stalled = {
        task: values[-1]
        for task, values in runs.items()
        if values[1:] and values[-1] > max(STALLED, (1.0 - STALLED) * values[-2])
    }
    high = {task: values[-1] for task, values in runs.items() if values and values[-1] > HIGH}
    coverage = {at(cell): median(of(rows, OURS, cell), "coverage") for cell in ours}
    narrow = {cell: value for cell, value in coverage.items() if value < COVERED}

    def against(cells: dict) -> str:
        return listed(
            f"{at(c)} to `{e}` ({ours[c]:.2f}; {scored[e, c]:.2f})" for c, e in cells.items()
        )

    return [
        f"- **Lowest TV**, or tied, among engines that are not told the likelihood: in "
        f"{len(met) - len(lost)} of {len(met)} cells that a peer shares, {useless} of them above "
        f"{USELESS}, where nobody knows much. `{OURS}` loses (its TV; the other's): "
        f"{against(lost)}.",
        f"- **PyVBMC is told the likelihood** and wins {len(beaten)} of {len(told)} cells: "
        f"{against(beaten)}.",
        f"- **More runs stop helping** on {valued(stalled)}: the last rise of N took off less than "
        f"{100 * STALLED:.0f} % of the TV.",
        f"- **90 % intervals hold too little**, less than {100 * COVERED:.0f} % of the exact "
        f"posterior, in {valued(narrow)}.",
        f"- **Take another tool** where your posterior is like that of {valued(high)}, whose TV is "
        f"above {HIGH} at the largest N: PyVBMC if a run tells the likelihood, else sbi's networks "
        "with thousands of runs, which are not compared here.",
    ]


def valued(values: dict) -> str:
    return listed(f"{name} ({value:.2f})" for name, value in values.items())


def losses(scored: dict, cells: Iterable[tuple[str, int]]) -> dict:
    """Cell -> the best engine, where `OURS` is farther than `TIE` behind it."""
    best = {
        cell: min((e for e, c in scored if c == cell), key=lambda e: scored[e, cell])
        for cell in sorted(cells, key=order)
    }
    return {c: e for c, e in best.items() if scored[OURS, c] - scored[e, c] > TIE}


def listed(parts: Iterable[str]) -> str:
    return ", ".join(parts) or "none"
