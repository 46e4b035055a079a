"""The table of the fluid study: what was named, by effect.

python tests/benchmarks/misfit/fluid_table.py fluid_study/results.jsonl
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from kept import results
from table import Result, covered, right, tied, wrong

VISIBLE = 10.0  # signal-to-noise ratio


def halved(result: Result) -> bool:
    """Whether the gap beyond noise on held-out data at least halved."""
    before, after = (
        sum(max(gap[k] ** 2 - gap[2] ** 2, 0.0) for gap in result["gaps"]) for k in (0, 1)
    )
    return after <= 0.25 * before


def row(label: str, those: list[Result]) -> str:
    """Of data sets in which the same acts."""
    named = [r for r in those if right(r)]
    counts = [
        len(those),
        len(named),
        sum(tied(r) for r in those),
        sum(wrong(r) for r in those),
        sum(r["verdict"] in ("none", "unknown") for r in those),
        f"{sum(halved(r) for r in named)} of {len(named)}",
        f"{sum(all(covered(r)) for r in named)} of {len(named)}",
    ]
    return f"| {label} | {' | '.join(map(str, counts))} |"


def table(found: list[Result]) -> str:
    """Markdown."""
    nulls = [r for r in found if not r["effects"]]
    visible = [r for r in found if r["effects"] and r["snr"] >= VISIBLE]
    faint = [r for r in found if r["effects"] and r["snr"] < VISIBLE]
    names = list(dict.fromkeys(r["effects"][0] for r in visible))
    headings = "effect | sets | right | tie with it | wrong | none | gap halved | interval covers"
    return "\n".join(
        [
            f"- {len(nulls)} nulls: {sum(r['verdict'] != 'none' for r in nulls)} alarms",
            f"- {len(faint)} sets below a signal-to-noise ratio of {VISIBLE:g} are left out",
            "",
            f"| {headings} |",
            "|-|-|-|-|-|-|-|-|",
            *(row(name, [r for r in visible if r["effects"] == [name]]) for name in names),
            row("all", visible),
        ]
    )


if __name__ == "__main__":
    print(table(results(Path(sys.argv[1]))))
