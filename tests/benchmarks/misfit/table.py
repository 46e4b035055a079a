"""The table of a study: how often criticism is right, by signal-to-noise ratio.

python tests/benchmarks/misfit/table.py study.jsonl
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from kept import results
from stand_in import EXTENSIONS

BINS = (0.0, 3.0, 5.0, 7.0, 10.0, 15.0, np.inf)
Result = dict


def share(which: list[bool]) -> str:
    """A share of the data sets, and its standard error."""
    p = float(np.mean(which)) if which else float("nan")
    return f"{p:.3f} ± {np.sqrt(p * (1 - p) / max(len(which), 1)):.3f}"


def right(result: Result) -> bool:
    """Whether the hidden effect alone was named."""
    return result["verdict"] == "effect" and result["effects"] == [result["effect"]]


def wrong(result: Result) -> bool:
    """Whether something else was."""
    return result["verdict"] == "effect" and not right(result)


def tied(result: Result) -> bool:
    """Whether the hidden effect is in a tie."""
    return result["verdict"] == "tie" and result["effect"] in result["effects"]


def by_ratio(known: list[Result]) -> list[str]:
    """Rows of detection and naming."""
    rows = ["| SNR | sets | detected | right | tie with it | wrong |", "|-|-|-|-|-|-|"]
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        those = [r for r in known if low <= r["snr"] < high]
        if those:
            cells = [
                share([r["p_value"] < 0.05 for r in those]),
                share([right(r) for r in those]),
                share([tied(r) for r in those]),
                share([wrong(r) for r in those]),
            ]
            label = f"{low:g} to {high:g}" if np.isfinite(high) else f"over {low:g}"
            rows.append(f"| {label} | {len(those)} | {' | '.join(cells)} |")
    return rows


def table(found: list[Result]) -> str:
    """Markdown."""
    nulls = [r for r in found if not r["effect"]]
    known = [r for r in found if r["effect"] in EXTENSIONS]
    outside = [r for r in found if r["effect"] and r["effect"] not in EXTENSIONS]
    named = [r for r in known if right(r) and r["interval"]]
    visible = [r for r in named if r["snr"] >= 10.0]

    def covered(r: Result) -> bool:
        return r["interval"][1] <= r["coefficient"] <= r["interval"][2]

    def halved(r: Result) -> bool:
        return r["gap"][1] <= 0.5 * r["gap"][0]

    lines = [
        f"- false alarms, {len(nulls)} data sets: {share([r['p_value'] < 0.05 for r in nulls])}",
        f"- wrong single name, {len(known)} sets: {share([wrong(r) for r in known])}",
        f"- unknown to the registry, {len(outside)} sets: a name past the held-out gate in "
        f"{share([r['verdict'] == 'effect' for r in outside])}, a single one before it in "
        f"{share([len(r['named']) == 1 for r in outside])}",
        f"- coefficient's 90 % interval covers, {len(named)} sets named right: "
        f"{share([covered(r) for r in named])}",
        f"- held-out gap at least halved: {share([halved(r) for r in named])} of those, "
        f"{share([halved(r) for r in visible])} at SNR 10 and above",
    ]
    return "\n".join([*lines, "", *by_ratio(known)])


if __name__ == "__main__":
    print(table(results(Path(sys.argv[1]))))
