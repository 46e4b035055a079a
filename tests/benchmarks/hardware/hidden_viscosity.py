"""Whether calibrating what the emulated arm recorded finds the viscosity that was hidden.

    python tests/benchmarks/hardware/hidden_viscosity.py --out DIRECTORY

Each viscosity is recorded by the emulated arm and rendered cameras, and calibrated as
`calibrate` does it. What DIRECTORY holds already is not made again, so an interrupted call goes on.
A session that this computer was too busy for is repeated; how often is printed.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
from bolfi_liquids.hardware import HiddenLiquid, SessionStopped, bundled_rig

import bolfi_liquids as bl
from bolfi_liquids.inputs.open import read_recording

VISCOSITIES = (0.05, 0.1, 0.3, 1.0, 1.0, 2.0, 3.0, 0.03, 0.5, 5.0)  # Pa s
TRIES = 6  # sessions
INTERVAL = 0.9


class Found(NamedTuple):
    """What was found of one hidden viscosity [Pa s]."""

    hidden: float
    low: float
    median: float
    high: float
    tries: int

    @property
    def held(self) -> bool:
        return self.low <= self.hidden <= self.high

    def __str__(self) -> str:
        interval = f"{self.low:8.4g} {self.median:8.4g} {self.high:8.4g}"
        return f"{self.hidden:8.4g} {interval} {'yes' if self.held else 'no':>5} {self.tries:6}"


HEADER = f"{'hidden':>8} {'5 %':>8} {'50 %':>8} {'95 %':>8} {'held':>5} {'tries':>6}  [Pa s]"


def recorded(directory: Path, liquid: HiddenLiquid) -> tuple[Path, int]:
    """A complete recording, and how many sessions it took.

    Raises:
        SessionStopped: None of `TRIES` sessions was carried out.
    """
    directory.mkdir(parents=True, exist_ok=True)
    made = sorted(directory.glob("session_*"))
    for session in made:
        file = session / "recording.nc"
        if file.exists() and read_recording(file).attrs["status"] == "complete":
            return file, len(made)
    for number in range(len(made) + 1, TRIES + 1):
        session = directory / f"session_{number}"
        try:
            found = bl.record(bundled_rig(), out=session, emulate=liquid, progress=False)
        except SessionStopped as err:
            print(f"{session}: {err}", flush=True)
            session.mkdir(exist_ok=True)  # what was tried counts, though nothing was recorded
            continue
        if found.attrs["status"] == "complete":
            return session / "recording.nc", number
    raise SessionStopped(f"{directory}: none of {TRIES} sessions was carried out")


def measured(directory: Path, viscosity: float, seed: int, surrogate: str) -> Found:
    """Record and calibrate one hidden liquid."""
    file, tries = recorded(directory, HiddenLiquid(viscosity=viscosity, seed=seed))
    run = directory / surrogate
    calibration = bl.calibrate(file, out=run, surrogate=surrogate, resume=True, progress=False)
    draws = calibration.posterior["viscosity"].to_numpy()
    tail = 0.5 * (1.0 - INTERVAL)
    low, median, high = np.quantile(draws, [tail, 0.5, 1.0 - tail])
    return Found(viscosity, float(low), float(median), float(high), tries)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("viscosities", nargs="*", type=float, help="Pa s; ten of them if none")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--surrogate", choices=("discrepancy", "signal"), default="discrepancy")
    chosen = parser.parse_args()
    print(HEADER, flush=True)
    rows, unmeasured = [], 0
    for place, viscosity in enumerate(chosen.viscosities or VISCOSITIES):
        try:
            found = measured(
                chosen.out / f"{place:02}_{viscosity:g}", viscosity, place, chosen.surrogate
            )
        except SessionStopped as err:
            print(f"{viscosity:8.4g} unmeasured: {err}", flush=True)
            unmeasured += 1
            continue
        rows.append(found)
        print(found, flush=True)
    held = sum(row.held for row in rows)
    print(f"held by the {INTERVAL:.0%} interval: {held} of {len(rows)}; {unmeasured} unmeasured")
    return int(unmeasured > 0)


if __name__ == "__main__":  # a session starts processes, which import this again
    raise SystemExit(main())
