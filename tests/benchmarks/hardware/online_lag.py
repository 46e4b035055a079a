"""How long `record --calibrate --emulator` prepares, and how late its estimates come.

    python tests/benchmarks/hardware/online_lag.py --out DIRECTORY

Each viscosity is stirred, recorded and calibrated as the command does it, with the usual settings.
The pours of the map are made in the first session only, as for a person who keeps the bank; with a
bank in DIRECTORY already they are not made at all. Estimates are printed as they come, then a line
for each viscosity.
"""

import argparse
import shutil
import time
from pathlib import Path

import numpy as np
from bolfi_liquids.hardware import HiddenLiquid, SessionStopped, bundled_rig
from bolfi_liquids.hardware.recorder.events import read_events

from bolfi_liquids.online.estimate import OnlineEstimate
from bolfi_liquids.online.online import LOG, USUAL_CYCLES, OnlineChoice
from bolfi_liquids.online.record import record_online, sentence

VISCOSITIES = (1.0, 0.1, 0.01)  # Pa s
TRIES = 4  # sessions, of which the computer may be too busy for some
MOST_PREPARATION, MOST_LAG = 600.0, 10.0  # s, the bars at 1 Pa s


def stirred(
    out: Path, viscosity: float, bank: Path, cycles: int
) -> tuple[float, list[OnlineEstimate]]:
    """Seconds until the session began, and what was estimated.

    Raises:
        SessionStopped: The arm was stopped.
    """
    told: list[OnlineEstimate] = []

    def tell(estimate: OnlineEstimate) -> None:
        told.append(estimate)
        print(f"  {sentence(estimate)}", flush=True)

    choice = OnlineChoice(out / "run", bank=bank, cycles=cycles, told=tell)
    began = time.monotonic()
    record_online(
        bundled_rig(),
        out=out / "recording",
        online=choice,
        emulate=HiddenLiquid(viscosity=viscosity),
        progress=False,
    )
    session = next(event for event in read_events(out / "recording") if event["kind"] == "session")
    return float(session["host"]) - began, told


def line(viscosity: float, preparation: float, told: list[OnlineEstimate]) -> str:
    """What one session took, in a line."""
    lags = np.array([estimate.lag for estimate in told])
    last = told[-1].parameters["viscosity"]
    return (
        f"{viscosity:g} Pa s: prepared in {preparation:.0f} s; {len(told)} estimates after "
        f"{[estimate.strokes for estimate in told]} strokes, late by {np.median(lags):.1f} s "
        f"(median), {lags.max():.1f} s (most); "
        f"viscosity at the end {last.q50:.3g} ({last.q05:.2g} to {last.q95:.2g})"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("viscosities", nargs="*", type=float, default=VISCOSITIES, help="Pa s")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cycles", type=int, default=USUAL_CYCLES)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    lines, wrong = [], []
    for viscosity in chosen.viscosities:
        for number in range(1, TRIES + 1):
            out = chosen.out / f"{viscosity:g}"
            shutil.rmtree(out, ignore_errors=True)
            try:
                preparation, told = stirred(
                    out, viscosity, chosen.out / "bank.sqlite", chosen.cycles
                )
            except SessionStopped as err:
                print(f"{viscosity:g} Pa s, session {number}: {err}", flush=True)
                continue
            lines.append(f"{line(viscosity, preparation, told)}; session {number}")
            print(lines[-1], flush=True)
            if viscosity == 1.0 and preparation > MOST_PREPARATION:
                wrong.append(f"preparation took {preparation:.0f} s")
            if viscosity == 1.0 and max(one.lag for one in told) > MOST_LAG:
                wrong.append(f"an estimate came {max(one.lag for one in told):.1f} s late")
            break
        else:
            wrong.append(f"{viscosity:g} Pa s: none of {TRIES} sessions was carried out")
    print("\n".join([*lines, *wrong, f"every estimate is in {chosen.out}/*/run/{LOG}"]))
    return int(bool(wrong))


if __name__ == "__main__":  # a session starts processes, which import this again
    raise SystemExit(main())
