"""Calibrations on recordings of the reference solver: does the interval hold the true viscosity?

    .venv/bin/python tests/benchmarks/calibrate_references.py tests/data/stirring_reference RUNS

Every recording without a hidden effect, from 0.01 Pa s on, is calibrated with 20 simulations into a
directory of its own below RUNS; one that is finished there is not calibrated again.
RUNS/calibrations.json holds what accuracy_page.py tells of them.
"""

import json
import sys
from datetime import date
from pathlib import Path

import numpy as np
from against.stirs import open_reference_stirs
from bolfi_liquids.models import MODEL_VERSION

import bolfi_liquids as bl

BUDGET = 20
LEAST_VISCOSITY = 0.01  # Pa s; thinner liquids look alike
HELD, ERROR = 11 / 14, 0.2  # bars: share of intervals that hold the truth, and median error


def main(folder: Path, runs: Path) -> None:
    held, errors, found = [], [], {}
    print(f"{'recording':20} {'Pa s':>6} {'5 %':>8} {'50 %':>8} {'95 %':>8}  holds")
    for reference in open_reference_stirs(folder).stirs:
        if reference.effects:
            continue
        truth = reference.viscosity
        if truth < LEAST_VISCOSITY:
            continue
        out = runs / reference.name
        calibration = bl.calibrate(
            reference.recording.path,
            budget=BUDGET,
            out=out,
            resume=out.exists(),
            progress=False,
        )
        low, middle, high = calibration.posterior["viscosity"].quantile([0.05, 0.5, 0.95]).values
        held.append(low <= truth <= high)
        errors.append(abs(middle / truth - 1.0))
        interval = {"q05": float(low), "q50": float(middle), "q95": float(high)}
        found[reference.name] = {"viscosity": truth, **interval}
        results = {
            "kind": "calibrations",
            "created": str(date.today()),
            "model": MODEL_VERSION,
            "budget": BUDGET,
            "calibrations": found,
        }
        (runs / "calibrations.json").write_text(json.dumps(results, indent=2) + "\n")
        print(
            f"{reference.name:20} {truth:6g} {low:8.3g} {middle:8.3g} {high:8.3g}  {held[-1]}",
            flush=True,
        )
    print(f"intervals that hold the truth: {sum(held)} of {len(held)} (bar {HELD:.2f})")
    print(f"median of |q50 / true - 1|: {np.median(errors):.3f} (bar {ERROR})")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
