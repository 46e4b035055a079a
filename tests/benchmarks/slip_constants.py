"""How the error of reference stirs depends on each constant of the stick's law of slip.

    .venv/bin/python tests/benchmarks/slip_constants.py tests/data/stirring_reference
    .venv/bin/python tests/benchmarks/slip_constants.py DIR --constant QUADRATIC --factors 0.8 1.25

Each value runs in a process of its own, as constants are compiled in. The table holds the RMS
difference to the recording [deg], camera noise removed, of one seed. QUADRATIC was found on liquids
of .001 and .01 Pa s, KERNEL on .001 to .3, TIP is flat; IMPULSE and HELD_RADIUS are theory.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np

CONSTANTS = ("QUADRATIC", "KERNEL", "TIP", "IMPULSE", "HELD_RADIUS")
FACTORS = (0.75, 0.9, 1.0, 1.1, 1.3)
RECORDINGS = ("water_v10", "water_v7", "cream_v10", "oil_v10", "oil_v10_wide", "glycerin_v10")
CAMERA_NOISE = 0.1  # deg


def errors(folder: Path, constant: str, factor: float) -> list[float]:
    """RMS differences [deg] of the recordings with one constant changed, in this process."""
    from bolfi_liquids.models.stirs import slip_law

    setattr(slip_law, constant, factor * getattr(slip_law, constant))
    from against.stir_replay import simulate_stir
    from against.stirs import open_reference_stirs

    stirs = {stir.name: stir for stir in open_reference_stirs(folder).stirs}
    found = []
    for name in RECORDINGS:
        signal = np.degrees(simulate_stir(stirs[name], np.zeros(1, int))[0])
        squared = np.mean((signal - np.degrees(stirs[name].recording.inclination)) ** 2)
        found.append(float(np.sqrt(max(squared - CAMERA_NOISE**2, 0.0))))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--constant", choices=CONSTANTS, nargs="+", default=CONSTANTS)
    parser.add_argument("--factors", type=float, nargs="+", default=FACTORS)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(*errors(given.folder, given.constant[0], given.factors[0]))
        return
    print(f"{'constant':12} {'times':>6}", *(f"{name:>12}" for name in RECORDINGS))
    for constant in given.constant:
        for factor in given.factors:
            command = [sys.executable, __file__, str(given.folder), "--one"]
            command += ["--constant", constant, "--factors", str(factor)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            row = (f"{float(value):12.2f}" for value in done.stdout.split()[-len(RECORDINGS) :])
            print(f"{constant:12} {factor:6g}", *row, flush=True)


if __name__ == "__main__":
    main()
