"""What a pour spills in the reference that was chosen from the reference's own stirs.

    .venv/bin/python tests/benchmarks/executed_pours.py tests/data RUNS

Recordings without a hidden effect, of liquids that the reference poured at many angular velocities,
are calibrated with 10 simulations, each into a directory of its own below RUNS, and one pour is
chosen. What it spills is interpolated linearly between those angular velocities, at the chosen
distance. The cup is held as long as the reference held its thickest liquids.
"""

import sys
import time
from pathlib import Path

import numpy as np
from against.pours import PouredLiquid, open_poured_liquids
from against.stirs import open_reference_stirs
from machine import machine

import bolfi_liquids as bl

BUDGET = 10
HOLD = 2.1  # s
TABLE = "pours_vof.csv"  # of cups that the liquids wet
MANY = 4  # angular velocities
BAR = 0.05  # spilled fraction
HEAD = "recording             deg/s    cm  promised  spilled  choice, s"


def main(data: Path, runs: Path) -> None:
    poured = {
        liquid.viscosity: liquid
        for liquid in open_poured_liquids(data / "pour_reference")
        if liquid.table == TABLE and len(liquid.pours) >= MANY
    }
    print(f"{machine()}\n{HEAD}", flush=True)
    spilled = []
    for stir in open_reference_stirs(data / "stirring_reference").stirs:
        if stir.effects or stir.viscosity not in poured:
            continue
        liquid, out = poured[stir.viscosity], runs / stir.name
        calibration = bl.calibrate(
            stir.recording.path, budget=BUDGET, out=out, resume=out.exists(), progress=False
        )
        pour = liquid.cups.pour.model_copy(update={"hold": HOLD})
        start = time.monotonic()
        chosen = bl.choose_pour(
            calibration, liquid.cups.model_copy(update={"pour": pour}), progress=False
        ).chosen
        took = time.monotonic() - start
        spilled.append(executed(liquid, chosen.angular_velocity, chosen.distance))
        print(
            f"{stir.name:20}{np.degrees(chosen.angular_velocity):7.1f}"
            f"{100.0 * chosen.distance:6.2f}{chosen.expected_spillage:10.4f}{spilled[-1]:9.4f}"
            f"{took:11.1f}",
            flush=True,
        )
    print(f"at most {max(spilled):.4f} of the liquid is spilled (bar {BAR})")


def executed(liquid: PouredLiquid, angular_velocity: float, distance: float) -> float:
    """Spilled fraction of one pour [rad/s, m], between those of the reference."""
    there = [np.interp(distance, pour.distance, pour.spilled) for pour in liquid.pours]
    return float(np.interp(angular_velocity, liquid.angular_velocity, there))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
