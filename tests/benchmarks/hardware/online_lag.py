"""How long `record --calibrate --emulator` prepares, and how late its estimates come.

    python tests/benchmarks/hardware/online_lag.py --out DIRECTORY

Each viscosity is stirred, recorded and calibrated as the command does it, with the usual settings.
The pours of the map are made in the first session only: the others begin with its bank. A line is
printed for each viscosity.
"""

import argparse
import json
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
from bolfi_liquids.hardware import HiddenLiquid, SessionStopped, bundled_rig
from bolfi_liquids.hardware.recorder.events import read_events

from bolfi_liquids.online.online import BANK, LOG, USUAL_CYCLES, OnlineChoice
from bolfi_liquids.online.record import record_online

VISCOSITIES = (1.0, 0.1, 0.01)  # Pa s
TRIES = 4  # sessions, of which the computer may be too busy for some
MOST_PREPARATION, MOST_LAG = 600.0, 10.0  # s, the bars at 1 Pa s


def stirred(
    out: Path, viscosity: float, bank: Path, cycles: int
) -> tuple[float, list[dict[str, Any]]]:
    """Seconds until the session began, and the lines of `online.jsonl`.

    Raises:
        SessionStopped: The arm was stopped.
    """
    run = out / "run"
    run.mkdir(parents=True)
    if bank.exists():
        shutil.copy(bank, run / BANK)
    began = time.monotonic()
    record_online(
        bundled_rig(),
        out=out / "recording",
        online=OnlineChoice(run, cycles=cycles),
        emulate=HiddenLiquid(viscosity=viscosity),
        progress=False,
    )
    shutil.copy(run / BANK, bank)
    session = next(event for event in read_events(out / "recording") if event["kind"] == "session")
    told = [json.loads(one) for one in (run / LOG).read_text().splitlines()]
    return float(session["host"]) - began, told


def line(viscosity: float, preparation: float, told: list[dict[str, Any]]) -> str:
    """What one session took, in a line."""
    lags = np.array([estimate["lag"] for estimate in told])
    last = told[-1]["parameters"]["viscosity"]
    return (
        f"{viscosity:g} Pa s: prepared in {preparation:.0f} s; {len(told)} estimates after "
        f"{[estimate['strokes'] for estimate in told]} strokes, late by {np.median(lags):.1f} s "
        f"(median), {lags.max():.1f} s (most); "
        f"viscosity at the end {last['q50']:.3g} ({last['q05']:.2g} to {last['q95']:.2g})"
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
            if viscosity == 1.0 and max(one["lag"] for one in told) > MOST_LAG:
                wrong.append(f"an estimate came {max(one['lag'] for one in told):.1f} s late")
            break
        else:
            wrong.append(f"{viscosity:g} Pa s: none of {TRIES} sessions was carried out")
    print("\n".join([*lines, *wrong, f"every estimate is in {chosen.out}/*/run/{LOG}"]))
    return int(bool(wrong))


if __name__ == "__main__":  # a session starts processes, which import this again
    raise SystemExit(main())
