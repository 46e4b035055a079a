"""Ten minutes of recording with the emulated arm: lost samples, memory, open files, loop jitter.

    python tests/benchmarks/hardware/long_recording.py --minutes 10

The emulated arm, two rendered cameras at 640x480 and all processes of a session. What
they hold is looked at every few seconds; growth is that of a line through what was seen.
"""

import argparse
import multiprocessing
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import psutil
import xarray
from bolfi_liquids.hardware import HiddenLiquid, bundled_rig
from bolfi_liquids.hardware.motion import stir

from bolfi_liquids.robot.record import record

EVERY = 5.0  # s between two looks
LEAST_LOOKS = 5
MOST_GROWTH = 20.0  # MB/h
LOST = ("lost_samples", "camera_xz_lost_frames", "camera_yz_lost_frames")
MOST_MISSED = 1e-3  # of the controller's packages, of which its client keeps only the newest
SETTLED = 20.0  # s, until buffers and caches have their size


class Watch(threading.Thread):
    """Looks at what the children of this process hold, and theirs."""

    def __init__(self):
        super().__init__(daemon=True)
        self.seen: dict[int, list[tuple[float, float, int]]] = {}
        self.names: dict[int, str] = {}

    def run(self):
        me, began = psutil.Process(), time.monotonic()
        while True:
            for one in me.children(recursive=True):
                try:
                    look = (time.monotonic() - began, one.memory_info().rss, one.num_fds())
                    self.seen.setdefault(one.pid, []).append(look)
                    self.names[one.pid] = " ".join(one.cmdline()[1:4])[-40:]
                except psutil.NoSuchProcess:
                    continue
            time.sleep(EVERY)

    def growths(self) -> dict[str, tuple[float, float, float, float]]:
        """By process that lasted: memory [MB], its growth [MB/h], open files, and more of them."""
        found = {}
        for pid, looks in self.seen.items():
            kept = np.array([look for look in looks if look[0] > SETTLED])
            if len(kept) >= LEAST_LOOKS:
                slope = np.polyfit(kept[:, 0], kept[:, 1] / 1e6, 1)[0] * 3600
                files = kept[:, 2]
                name = f"{pid} {self.names[pid]}"
                found[name] = kept[-1, 1] / 1e6, slope, files[-1], files[-1] - files[0]
        return found

    def table(self) -> str:
        """What each process holds, and how that grows."""
        lines = [f"{'process':48} {'MB':>7} {'MB/h':>7} {'files':>6} {'more':>5}"]
        for name, (memory, slope, files, more) in self.growths().items():
            lines.append(f"{name:48} {memory:7.1f} {slope:7.1f} {files:6.0f} {more:5.0f}")
        return "\n".join(lines)

    def growing(self) -> list[str]:
        """What grows beyond `MOST_GROWTH`, or opens files and keeps them."""
        return [
            f"{name} grows by {slope:.0f} MB/h and {more:.0f} files"
            for name, (_, slope, _, more) in self.growths().items()
            if slope > MOST_GROWTH or more > 0
        ]


def make(directory: Path, cycles: int) -> None:
    """Record; in a process of its own, apart from what the watch remembers."""
    record(bundled_rig(), out=directory, emulate=HiddenLiquid(), cycles=cycles, progress=False)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--out", type=Path, help="keep the recording there")
    chosen = parser.parse_args()
    rig = bundled_rig()
    once = stir(rig, 2).duration - stir(rig, 1).duration
    cycles = int(np.ceil(60.0 * chosen.minutes / once))
    watch = Watch()
    watch.start()
    with tempfile.TemporaryDirectory() as directory:
        out = chosen.out or Path(directory) / "recording"
        recorder = multiprocessing.get_context("spawn").Process(target=make, args=(out, cycles))
        recorder.start()
        recorder.join()
        with xarray.open_dataset(out / "recording.nc", decode_times=False) as made:
            attributes, duration = dict(made.attrs), float(made["time"][-1])
    print(f"{duration / 60:.1f} minutes, {attributes['status']} ({attributes['reason']})")
    for name, value in attributes.items():
        if name.startswith(("lost", "missed", "loop", "sample_rate")) or name.endswith(
            ("lost_frames", "rate")
        ):
            print(f"{name}: {value:.6g}")
    print(watch.table())
    wrong = watch.growing()
    for name in LOST:
        if attributes[name]:
            wrong.append(f"{name} = {attributes[name]}")
    missed = attributes["missed_packages"] / (duration * rig.robot.rate)
    if missed > MOST_MISSED:
        wrong.append(f"{missed:.2%} of the controller's packages were missed")
    if abs(attributes["sample_rate"] / rig.robot.rate - 1.0) > MOST_MISSED:
        wrong.append(f"sample_rate = {attributes['sample_rate']:.2f} Hz")
    if attributes["status"] != "complete":
        wrong.append(attributes["reason"])
    print("; ".join(wrong) or "nothing lost, nothing growing")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
