"""Speed of the fluid, and how well it repeats pours, beside their bars.

    .venv/bin/python tests/benchmarks/fluid.py --recordings FOLDER --only speed pours

FOLDER holds recordings LIQUID_*.nc and the tables of pours with their cups; without it, and
without BOLFI_LIQUIDS_RECORDINGS, the bundled recordings are taken, and pours are left out. The
comparison with SPlisHSPlasH needs an environment of its own: `make peers`. Times are true only on
a machine that does nothing else.
"""

import argparse
import os
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path

from bars import (
    HEAD,
    Line,
    against_peer,
    pours,
    row,
    start_up,
    stirring_seconds,
    throughput,
)
from machine import machine

BUNDLED = Path(str(files("bolfi_liquids.data")))
TIMED = BUNDLED / "glycerin_v10.nc"
PARTS: dict[str, Callable[[Path], Iterator[Line]]] = {
    "speed": lambda _: stirring_seconds(TIMED),
    "throughput": lambda _: throughput(TIMED),
    "start": lambda _: start_up(TIMED),
    "peer": lambda _: against_peer(TIMED),
    "pours": pours,
}


def main(arguments: list[str] | None = None) -> None:
    chosen = _parser().parse_args(arguments)
    print(f"{machine()}\n{HEAD}", flush=True)
    lines = []
    for name in chosen.only:
        before = len(lines)
        for line in PARTS[name](chosen.recordings):
            print(row(line), flush=True)
            lines.append(line)
        if len(lines) == before:
            print(f"{name}: not measured, see --help")
    held = [line for line in lines if line.met is not None]
    print(f"{sum(line.met is True for line in held)} of {len(held)} bars met")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    folder = Path(os.environ.get("BOLFI_LIQUIDS_RECORDINGS", BUNDLED))
    parser.add_argument("--recordings", type=Path, metavar="FOLDER", default=folder)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    return parser


if __name__ == "__main__":
    main()
