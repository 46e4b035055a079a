"""The command of `make paper`: what has finished is kept, and a killed one goes on."""

import argparse
from pathlib import Path

from bolfi_liquids.run.compute import processes

from .figures import FIGURES, draw_figures
from .study_size import FULL, QUICK


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.paper", description=__doc__)
    parser.add_argument("figures", nargs="*", choices=FIGURES, help="all without any")
    parser.add_argument(
        "--quick", action="store_true", help="fewer truths and coarser maps, in runs/paper_quick"
    )
    given = parser.parse_args()
    # of one scale each, so that no figure of the one stands beside some of the other
    out, scale = Path("runs/paper"), FULL
    if given.quick:
        out, scale = Path("runs/paper_quick"), QUICK
    with processes() as executor:
        for name, drawn in draw_figures(given.figures or FIGURES, out, scale, executor):
            print(f"{out / name}.png\n{drawn.says}\n", flush=True)


if __name__ == "__main__":
    main()
