"""`python -m ur_controller`: one emulated controller, until it is told to end."""

import argparse
import json
import math
import os
import select
import signal
import sys
from collections.abc import Callable

from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.process import hurry

from .controller import HOME_JOINTS, MODELS, Options
from .loop import ControllerServer


def main(arguments: list[str] | None = None) -> int:
    """Run an emulator; 2 if it cannot start."""
    parser = _parser()
    given = parser.parse_args(arguments)
    try:
        emulator = ControllerServer(given.address, _options(given))
    except (RigError, TypeError, ValueError) as err:
        print(f"emulator: {err}", file=sys.stderr)
        return 2
    running = _until_told(given.while_stdin)
    hurry()  # a controller keeps its time whatever else this computer does
    print(f"ready {given.address} {given.controller}", flush=True)
    try:
        emulator.run(running)
    finally:
        emulator.close()
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m ur_controller", description=__doc__)
    parser.add_argument("--address", default="127.0.0.5", help="one of 127.0.0.0/8")
    parser.add_argument("--controller", choices=sorted(MODELS), default="cb3")
    parser.add_argument(
        "--joints", type=json.loads, default=list(HOME_JOINTS), help="JSON, six in rad"
    )
    parser.add_argument("--tcp", type=json.loads, default=[0.0] * 6, help="JSON, six in m and rad")
    parser.add_argument("--rate", type=float, help="ticks per second")
    parser.add_argument("--seed", type=int, default=0, help="of the force's noise")
    parser.add_argument("--unlock-after", type=float, default=5.0, help="of a protective stop, s")
    parser.add_argument("--while-stdin", action="store_true", help="end when the input ends")
    return parser


def _options(given: argparse.Namespace) -> Options:
    if len(given.joints) != 6 or not all(math.isfinite(value) for value in given.joints):
        raise ValueError(f"--joints must be six finite numbers in rad, got {given.joints}")
    if given.rate is not None and not 10.0 <= given.rate <= 500.0:
        raise ValueError(f"--rate must be between 10 and 500 ticks per second, got {given.rate}")
    return Options(
        controller=given.controller,
        joints=tuple(float(value) for value in given.joints),
        tcp=tuple(float(value) for value in given.tcp),
        rate=given.rate,
        seed=given.seed,
        unlock_after=given.unlock_after,
    )


def _until_told(while_stdin: bool) -> Callable[[], bool]:
    """False after SIGINT or SIGTERM, and with `while_stdin` at the input's end."""
    told: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: told.append(received))

    def running() -> bool:
        if while_stdin and select.select([sys.stdin], [], [], 0.0)[0]:
            # anything that is not the end is of no interest
            return bool(os.read(sys.stdin.fileno(), 65536)) and not told
        return not told

    return running


if __name__ == "__main__":
    sys.exit(main())
