"""The tables of a study: how often criticism is right, and how often other methods are.

python tests/benchmarks/misfit/table.py study.jsonl [--others others.jsonl]
"""

import argparse
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.stats import beta

sys.path.insert(0, str(Path(__file__).parent))

from kept import results

BINS = (0.0, 3.0, 5.0, 10.0, 15.0, np.inf)  # SNR beyond all rivals
STRONG = 10.0  # SNR from which an effect should be named alone
HIDDEN = 3.0  # SNR below which a rival explains what an effect does
LEVEL = 0.05  # p-value below which a model is rejected
FIFTHS = np.linspace(0.0, 1.0, 6)  # of stated probability
SURE = 0.95  # stated probability, from which a row of its own is made
BAND = 0.99
JOIN = " with "
Result = dict


def share(which: Sequence[bool]) -> str:
    """A share of the data sets, and its standard error."""
    p = float(np.mean(which)) if which else float("nan")
    return f"{p:.3f} ± {np.sqrt(p * (1 - p) / max(len(which), 1)):.3f}"


def right(result: Result) -> bool:
    """Whether the hidden effects alone were named."""
    return result["verdict"] == "effect" and set(result["named"]) == set(result["effects"])


def wrong(result: Result) -> bool:
    """Whether something else was."""
    return result["verdict"] == "effect" and not right(result)


def tied(result: Result) -> bool:
    """Whether what is hidden is in a tie."""
    return result["verdict"] == "tie" and set(result["effects"]) <= set(result["named"])


def detected(result: Result) -> bool:
    """Whether the verdict is that something is missing."""
    return result["verdict"] != "none"


def rejected(result: Result) -> bool:
    """Whether the base model was, by its p-value."""
    return result["p_value"] < LEVEL


def covered(result: Result) -> list[bool]:
    """Whether each coefficient's 90 % interval holds the truth."""
    ends = {name: interval[1:] for name, interval in result["intervals"].items()}
    return [low <= result["theta"][name] <= high for name, (low, high) in ends.items()]


def halved(result: Result) -> bool:
    """Whether the gap on held-out data is at most half of what it was."""
    return result["gap"][1] <= 0.5 * result["gap"][0]


class Kinds:
    """Results by what was hidden."""

    def __init__(self, found: Sequence[Result]):
        self.crashed = [r for r in found if "crash" in r]
        found = [r for r in found if "crash" not in r]
        self.nulls = [r for r in found if r["truth"] == "none"]
        self.outside = [r for r in found if r["truth"] == "none of these"]
        known = [r for r in found if r["truth"] not in ("none", "none of these")]
        self.singles = [r for r in known if len(r["effects"]) == 1]
        self.pairs = [r for r in known if len(r["effects"]) > 1]
        self.named = [r for r in known if right(r)]
        self.found = found


def between(found: Sequence[Result], low: float, high: float) -> list[Result]:
    """Those whose SNR beyond all rivals lies in [low, high)."""
    return [r for r in found if low <= r["snr"] < high]


def row(label: str, found: Sequence[Result]) -> str:
    """One subject's line of the first table."""
    of = Kinds(found)
    ties = [r for r in between(of.singles, 5.0, STRONG) if r["verdict"] == "tie"]
    strong = between(of.singles, STRONG, np.inf)
    cells = [
        str(len(found)),
        f"{sum(map(detected, of.nulls))} of {len(of.nulls)}",
        f"{sum(map(rejected, of.nulls))}",
        f"{share([right(r) for r in strong])} of {len(strong)}",
        f"{sum(map(tied, ties))} of {len(ties)}",
        f"{sum(map(wrong, of.singles))} of {len(of.singles)}",
        f"{sum(r['verdict'] == 'effect' for r in of.outside)} of {len(of.outside)}",
        share([yes for r in of.named for yes in covered(r)]),
        share([halved(r) for r in of.named]),
        str(len(of.crashed)),
    ]
    return f"| {label} | {' | '.join(cells)} |"


HEAD = (
    "subject | sets | false alarms | p < .05 | right alone, SNR over 10 | "
    "ties with the truth, SNR 5 to 10 | wrong name | outside, named | interval covers | "
    "gap halved | crashes"
)


def heading(columns: str) -> list[str]:
    """The first two lines of a table."""
    return [f"| {columns} |", "|-" * (columns.count("|") + 1) + "|"]


def by_ratio(singles: Sequence[Result]) -> list[str]:
    """Detection and naming of single effects."""
    rows = heading("SNR | sets | detected | right alone | tie with it | other tie | wrong name")
    for low, high in pairwise(BINS):
        those = between(singles, low, high)
        if those:
            cells = [
                share([detected(r) for r in those]),
                share([right(r) for r in those]),
                share([tied(r) for r in those]),
                share([r["verdict"] == "tie" and not tied(r) for r in those]),
                share([wrong(r) for r in those]),
            ]
            label = f"{low:g} to {high:g}" if np.isfinite(high) else f"over {low:g}"
            rows.append(f"| {label} | {len(those)} | {' | '.join(cells)} |")
    return rows


def hidden_behind_rivals(singles: Sequence[Result]) -> str:
    """What is said where data show that something is missing, but not what."""
    those = [r for r in between(singles, 0.0, HIDDEN) if r["visible"] >= STRONG]
    counts = [sum(map(kind, those)) for kind in (tied, right, wrong)]
    return (
        f"Of {len(those)} sets with an effect that a rival imitates (SNR {STRONG:g} and more "
        f"beyond the base parameters, below {HIDDEN:g} beyond all rivals) {counts[0]} are a tie "
        f"with it, {counts[1]} named alone, {counts[2]} named wrongly."
    )


def of_pairs(pairs: Sequence[Result]) -> str:
    """What is said where two effects act."""
    strong = between(pairs, STRONG, np.inf)
    one = [r["verdict"] == "effect" and set(r["named"]) < set(r["effects"]) for r in strong]
    return (
        f"Of {len(pairs)} sets with two effects {sum(map(right, pairs))} are named right; of "
        f"{len(strong)} with an SNR of {STRONG:g} and more beyond all rivals "
        f"{sum(map(right, strong))}, and one of both in {sum(one)}."
    )


# Stated probabilities.


def probabilities(result: Result) -> dict[frozenset[str], float]:
    """By the explanation's names."""
    return {frozenset(key.split(JOIN)): p for key, p in result["probabilities"].items()}


def truth(result: Result) -> frozenset[str]:
    """The explanation that is right."""
    return frozenset(result["truth"].split(JOIN))


def brier(result: Result) -> float:
    """Sum over all explanations of the squared error of the probability, from 0 to 2."""
    stated = probabilities(result)
    stated.setdefault(truth(result), 0.0)
    return sum((p - (one == truth(result))) ** 2 for one, p in stated.items())


def exact_band(hits: int, count: int) -> tuple[float, float]:
    """Of a share (Clopper and Pearson 1934)."""
    tail = (1.0 - BAND) / 2.0
    low = beta.ppf(tail, hits, count - hits + 1) if hits else 0.0
    high = beta.ppf(1.0 - tail, hits + 1, count - hits) if hits < count else 1.0
    return float(low), float(high)


def calibration(found: Sequence[Result]) -> list[str]:
    """The most probable explanation's stated probability, and how often it is right; by fifths,
    and once more where that is `SURE`."""
    stated = [(probabilities(r), truth(r)) for r in found]
    best = [max(p, key=lambda one: p[one]) for p, _ in stated]
    top = np.array([p[one] for (p, _), one in zip(stated, best, strict=True)])
    hit = np.array([one == true for (_, true), one in zip(stated, best, strict=True)], bool)
    rows = heading("stated | sets | mean stated | right | 99 % band | holds")
    for low, high in [*pairwise(FIFTHS), (SURE, 1.0)]:
        here = (top >= low) & ((top < high) | (high == 1.0))
        if here.any():
            count, hits, mean = int(here.sum()), int(hit[here].sum()), float(top[here].mean())
            ends = exact_band(hits, count)
            holds = "yes" if ends[0] <= mean <= ends[1] else "no"
            cells = f"{count} | {mean:.3f} | {hits / count:.3f} | {ends[0]:.2f} to {ends[1]:.2f}"
            rows.append(f"| {low:.2g} to {high:.2g} | {cells} | {holds} |")
    return rows


def made(found: Sequence[Result]) -> list[str]:
    """When, where and of which code."""
    return [*sorted({f"- {r['made']}" for r in found}), ""]


def table(found: Sequence[Result]) -> str:
    """Markdown."""
    names = sorted({r["subject"] for r in found})
    by_subject = {name: [r for r in found if r["subject"] == name] for name in names}
    by_subject["all"] = list(found)
    lines = [*made(found), *heading(HEAD), *(row(name, of) for name, of in by_subject.items())]
    for name, those in by_subject.items():
        of = Kinds(those)
        lines += ["", f"### {name}", "", *by_ratio(of.singles), ""]
        lines += [hidden_behind_rivals(of.singles), of_pairs(of.pairs)]
        score = np.mean([brier(r) for r in of.found])
        lines += ["", f"Brier score {score:.3f}; the most probable explanation:", ""]
        lines += calibration(of.found)
    return "\n".join(lines)


def joined(found: Sequence[Result], others: Sequence[Result]) -> list[Result]:
    """What other methods make of the sets that criticism was tried on, and criticism itself."""
    ours = {(r["subject"], r["number"]): r for r in found if "crash" not in r}
    both = [r for r in others if (r["subject"], r["number"]) in ours]
    for r in both:
        our = ours[r["subject"], r["number"]]
        r["detects"]["criticism"] = detected(our)
        if our["verdict"] == "effect":
            r["names"]["criticism"] = JOIN.join(our["named"])
    return both


def side_by_side(found: Sequence[Result]) -> str:
    """Markdown: what each method detects and names; see `joined`."""
    nulls = [r for r in found if r["truth"] == "none"]
    outside = [r for r in found if r["truth"] == "none of these"]
    singles = [r for r in found if r not in nulls and r not in outside and len(r["effects"]) == 1]
    weak, strong = between(singles, HIDDEN, STRONG), between(singles, STRONG, np.inf)
    columns = (
        f"method | false alarms ({len(nulls)}) | detects, SNR 3 to 10 ({len(weak)}) | over 10 "
        f"({len(strong)}) | names right, 3 to 10 | over 10 | names wrongly | outside, detected "
        f"({len(outside)}) | named"
    )
    rows = heading(columns)
    for method in found[0]["detects"]:

        def alarm(r: Result, method: str = method) -> bool:
            return r["detects"][method]

        def hit(r: Result, method: str = method) -> bool:
            return r["names"].get(method) == r["effects"][0]

        def miss(r: Result, method: str = method) -> bool:
            return method in r["names"] and not hit(r)

        cells = [share([alarm(r) for r in those]) for those in (nulls, weak, strong)]
        if any(method in r["names"] for r in found):
            cells += [share([hit(r) for r in those]) for those in (weak, strong)]
            cells += [share([miss(r) for r in weak + strong])]
            last = share([method in r["names"] for r in outside])
        else:
            cells, last = [*cells, "-", "-", "-"], "-"
        cells += [share([alarm(r) for r in outside]), last]
        rows.append(f"| {method} | {' | '.join(cells)} |")
    return "\n".join([*made(found), *rows])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path)
    parser.add_argument("--others", type=Path)
    asked = parser.parse_args()
    print(table(results(asked.study)))
    if asked.others:
        both = joined(results(asked.study), results(asked.others))
        print(f"\n### other methods\n\n{side_by_side(both)}")
