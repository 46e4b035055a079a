"""Speed of the fluid beside its bars.

    .venv/bin/python tests/benchmarks/fluid.py --only speed start

The comparison with SPlisHSPlasH needs an environment of its own: `make peers`. Times are true only
on a machine that does nothing else. How well pours land is judged by `make against`.
"""

import argparse
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path

from bars import (
    HEAD,
    Line,
    against_peer,
    row,
    start_up,
    stirring_seconds,
    throughput,
)
from machine import machine

TIMED = Path(str(files("bolfi_liquids.data"))) / "glycerin_v10.nc"
PARTS: dict[str, Callable[[Path], Iterator[Line]]] = {
    "speed": stirring_seconds,
    "throughput": throughput,
    "start": start_up,
    "peer": against_peer,
}


def main(arguments: list[str] | None = None) -> None:
    chosen = _parser().parse_args(arguments)
    print(f"{machine()}\n{HEAD}", flush=True)
    lines = []
    for name in chosen.only:
        before = len(lines)
        for line in PARTS[name](TIMED):
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
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    return parser


if __name__ == "__main__":
    main()
