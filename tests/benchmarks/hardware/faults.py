"""What happens to the arm and to the recording when something fails while it stirs.

    python tests/benchmarks/hardware/faults.py --times 20 --out faults.jsonl

Each run has an emulated controller, the real client, and a whole session whose main process is a
process of its own. A fault is injected at a random time during motion; a watcher that reads the
controller's admin port says when the arm was at rest, and that it stayed so. The table holds the
worst run.
It takes an hour, on a computer that does nothing else; `--out` keeps each run, and goes on there.
"""

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from bolfi_liquids.hardware.motion.stir_paths import stir
from bolfi_liquids.hardware.recorder.events import outcome, read_events
from bolfi_liquids.hardware.recorder.samples import SAMPLES
from faulty_session import small_rig

sys.path.append(str(Path(__file__).parents[2] / "hardware"))
from ur_controller.process import (
    Admin,  # noqa: E402
    ControllerProcess,  # noqa: E402
)

WATCHED = 2.0  # s after a fault, in which nothing may restart
LOST = 1.0  # s of the recording before a fault that may be missing
DEAD, ALIVE = 0.5, 0.3  # s to rest where our process is dead, and where it lives
STALL = 0.3  # s, of the loop
UNSEEN = 0.2  # s, at the end of the watch, of which the watcher may not have heard yet
EARLIEST = 0.2  # s of a motion, for a fault
PATIENCE = 5.0  # s, for the arm to move
TRIES = 8  # of a run whose session ended before its fault


class Fault(NamedTuple):
    """A fault, the time that the arm has to come to rest [s], and words of the reason."""

    inject: Callable[["UnderTest"], None]
    bar: float
    reason: str


class UnderTest(NamedTuple):
    """What a fault can be done to: processes by name, the emulator, and the flags' directory."""

    pids: dict[str, int]
    admin: Admin
    flags: Path


class Result(NamedTuple):
    """Of one run: time to rest [s], end of its tables from the fault [s], restarts, reason.

    `repeated` counts the sessions before it that had ended before their fault.
    """

    fault: str
    seed: int
    rest: float
    kept: float
    restarts: int
    left_behind: int
    reason: str
    repeated: int = 0

    def fails(self, fault: Fault) -> str:
        """What breaks a bar; empty if nothing does."""
        wrong = []
        if self.rest > fault.bar:
            wrong.append(f"at rest after {self.rest:.3f} s, above {fault.bar} s")
        if self.kept < -LOST:
            wrong.append(f"a table ends {-self.kept:.2f} s before the fault")
        if self.restarts:
            wrong.append(f"the arm began to move {self.restarts} times after it rested")
        if self.left_behind:
            wrong.append(f"{self.left_behind} processes live on")
        if not re.search(fault.reason, self.reason):
            wrong.append(f"the reason {self.reason!r} lacks {fault.reason!r}")
        return "; ".join(wrong)


def _kill(name: str) -> Callable[[UnderTest], None]:
    return lambda rig: os.kill(rig.pids[name], signal.SIGKILL)


def _flag(name: str) -> Callable[[UnderTest], None]:
    return lambda rig: (rig.flags / name).touch()


def _stall(rig: UnderTest) -> None:
    os.kill(rig.pids["control"], signal.SIGSTOP)
    threading.Timer(STALL, lambda: os.kill(rig.pids["control"], signal.SIGCONT)).start()


def _fill_disk(rig: UnderTest) -> None:
    """The recorder's files can grow no more: what a full disk does to it."""
    import resource

    size = max(path.stat().st_size for path in rig.flags.iterdir() if path.name == SAMPLES)
    resource.prlimit(rig.pids["recorder"], resource.RLIMIT_FSIZE, (size, size))


FAULTS = {
    "control process killed": Fault(_kill("control"), DEAD, "control process killed by SIGKILL"),
    "main process killed": Fault(_kill("main"), ALIVE, "main process is gone"),
    "recorder killed": Fault(_kill("recorder"), ALIVE, "recorder"),
    "link dropped": Fault(lambda rig: rig.admin.drop(), ALIVE, "connection|control process killed"),
    "link frozen": Fault(lambda rig: rig.admin.freeze(10.0), ALIVE, "silence"),
    "camera stops": Fault(_flag("camera_stops"), ALIVE, "camera xz"),
    "camera frozen": Fault(_flag("camera_freezes"), ALIVE, "camera xz|same picture"),
    "disk full": Fault(_fill_disk, ALIVE, "cannot write|write failed"),
    "force limit": Fault(lambda rig: rig.admin.force([30.0, 0, 0, 0, 0, 0]), ALIVE, "force: "),
    "protective stop": Fault(lambda rig: rig.admin.protective_stop(), ALIVE, "protective stopped"),
    "NaN target": Fault(_flag("order_nan"), ALIVE, "refused.*not finite"),
    "target outside the box": Fault(_flag("order_outside"), ALIVE, "refused.*outside"),
    "loop overrun": Fault(_stall, ALIVE, "overrun"),
}


# -- the watcher


class Watcher:
    """Follows the arm's state at the emulator, tick by tick, in a thread of its own."""

    def __init__(self, admin: Admin):
        self.moving: list[float] = []
        self.resting: list[float] = []
        self._states = admin.stream()
        threading.Thread(target=self._follow, daemon=True).start()

    def _follow(self) -> None:
        try:
            for state in self._states:
                (self.resting if state.resting else self.moving).append(state.host)
        except OSError:
            return  # the emulator has ended

    def wait_for_motion(self) -> bool:
        """Until the arm moves just now; false if it does not."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self.moving and time.monotonic() - self.moving[-1] <= 0.03:
                return True
            time.sleep(0.002)
        return False

    def rest_after(self, since: float) -> float:
        """Time from `since` to the last tick in motion [s], however late that was.

        Raises:
            RuntimeError: The emulator did not tell until the end.
        """
        seen = max([*self.moving, *self.resting], default=0.0)
        if seen < since + WATCHED - UNSEEN:
            raise RuntimeError(f"the emulator has told nothing since {seen - since:.2f} s")
        return max((host for host in self.moving if host >= since), default=since) - since


class Disturbed(Exception):
    """The session had ended before the fault: this computer stood still, or was too slow."""


def run_fault(name: str, seed: int, latest: float) -> Result:
    """One run; what happens from the fault on counts, whatever else this computer did."""
    for tried in range(TRIES):
        try:
            result = _run_once(name, seed + 1000 * tried, latest)
            return result._replace(seed=seed, repeated=tried)
        except Disturbed as early:
            print(f"ended before the fault: {early}", file=sys.stderr, flush=True)
    raise RuntimeError(f"{name}: {TRIES} sessions ended before their fault")


def _run_once(name: str, seed: int, latest: float) -> Result:
    chance = random.Random(f"{name} {seed}")
    rig = small_rig()
    with (
        tempfile.TemporaryDirectory() as directory,
        ControllerProcess.at_pose(rig, stir(rig).pose[0]) as emulator,
    ):
        script = Path(__file__).with_name("faulty_session.py")
        command = [sys.executable, str(script), directory, emulator.address]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as main:
            assert main.stdout is not None
            said = main.stdout.readline()
            if not said:
                raise Disturbed(f"{name}: the session did not start; {emulator.notes()}")
            under_test = UnderTest(json.loads(said), emulator.admin, Path(directory))
            try:
                return _inject(name, under_test, chance.uniform(EARLIEST, latest))
            finally:
                _end(main)


def _end(main: subprocess.Popen) -> None:
    try:
        main.wait(10.0)
    except subprocess.TimeoutExpired:
        main.kill()


def _inject(name: str, rig: UnderTest, delay: float) -> Result:
    watcher = Watcher(rig.admin)
    time.sleep(delay)
    recording = rig.flags / "recording"
    if not watcher.wait_for_motion() or _stopped(recording):
        raise Disturbed(f"{name}: {outcome(read_events(recording)).reason}")
    at = time.monotonic()
    FAULTS[name].inject(rig)
    time.sleep(DEAD)
    motions = rig.admin.motions()
    time.sleep(WATCHED - DEAD)
    tables = (SAMPLES, "frames_xz.csv", "frames_yz.csv")
    return Result(
        fault=name,
        seed=0,
        rest=watcher.rest_after(at),
        kept=min(_last_row(recording / table) for table in tables) - at,
        restarts=rig.admin.motions() - motions,
        left_behind=sum(_lives(pid) for who, pid in rig.pids.items() if who != "main"),
        reason=outcome(read_events(recording)).reason,
    )


def _stopped(recording: Path) -> bool:
    return any(event["kind"] == "stopped" for event in read_events(recording))


def _last_row(path: Path) -> float:
    """Host time of a table's last whole row [s]; a frame's stamp is by this computer's clock."""
    rows = path.read_text(encoding="utf-8").splitlines()
    names = rows[0].split(",")
    host = names.index("host" if "host" in names else "stamp")
    whole = [row for row in rows[1:] if row.count(",") == rows[0].count(",")]
    return float(whole[-1].split(",")[host])


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


# -- the table


def table(results: list[Result]) -> str:
    """One row for each fault: its worst run."""
    head = f"{'fault':24} {'runs':>4} {'failed':>6} {'rest':>7} {'kept to':>8} {'repeated':>8}"
    lines = [f"{head}  reason"]
    for name, fault in FAULTS.items():
        runs = [result for result in results if result.fault == name]
        if not runs:
            continue
        worst = max(runs, key=lambda run: run.rest)
        failed = sum(bool(run.fails(fault)) for run in runs)
        kept = min(run.kept for run in runs)
        lines.append(
            f"{name:24} {len(runs):4d} {failed:6d} {worst.rest:5.3f} s {kept:+6.2f} s "
            f"{sum(run.repeated for run in runs):8d}  {worst.reason[:80]}"
        )
    lines.append("repeated: sessions that ended before their fault, this computer being too slow")
    return "\n".join(lines)


def kept_in(path: Path | None) -> list[Result]:
    """The runs that a file holds; none without a file."""
    if path is None or not path.exists():
        return []
    return [Result(**json.loads(line)) for line in path.read_text().splitlines()]


def keep(result: Result, path: Path | None) -> None:
    """Append a run to a file, if there is to be one."""
    if path is not None:
        with path.open("a") as file:
            file.write(json.dumps(result._asdict()) + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--only", choices=list(FAULTS), action="append")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--latest", type=float, default=5.0, help="of a motion, for a fault [s]")
    parser.add_argument("--out", type=Path, help="keep runs here; those that it holds count")
    chosen: Any = parser.parse_args()
    seeds = range(chosen.seed, chosen.seed + chosen.times)
    asked = [(name, seed) for seed in seeds for name in chosen.only or FAULTS]
    results = [one for one in kept_in(chosen.out) if (one.fault, one.seed) in asked]
    done = {(one.fault, one.seed) for one in results}
    for name, seed in asked:
        if (name, seed) not in done:
            results.append(run_fault(name, seed, chosen.latest))
            keep(results[-1], chosen.out)
            fails = results[-1].fails(FAULTS[name])
            print(f"{len(results)}/{len(asked)} {name}: {fails or 'well'}", file=sys.stderr)
    print(table(results))
    return int(any(one.fails(FAULTS[one.fault]) for one in results))


if __name__ == "__main__":
    sys.exit(main())
