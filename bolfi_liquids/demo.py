"""The whole way on bundled data: stir, learn, find what the simulator lacks, pour, report."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from importlib.resources import as_file, files
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .calibration.calibrate import calibrate
from .criticism.criticise import criticise
from .errors import Argument, InputError
from .files import given_path
from .inputs.cups import bundled_cups
from .inputs.open import open_recording
from .inputs.settings import CalibrationSettings, PourSettings
from .models import runtime
from .pouring.choose import choose_pour, decided
from .reporting.report import report
from .run.run import RUN_TOML, Run

if TYPE_CHECKING:
    from .calibration.result import Calibration
    from .criticism.result import Criticism
    from .inference.simulations import Compute
    from .inputs.recording import Recording
    from .pouring.result import Pour

RECORDING, HELD_OUT = "late_oil_v10.nc", "late_oil_v7.nc"  # the cameras were late, and say nothing
CLEAN = "clean_oil_v10.nc"  # the same strokes of an arm whose cameras were in time
POURS = 24  # that each decision's map is learned from: few, as two are made


class Step(NamedTuple):
    """A step of the demo.

    Attributes:
        name: Of the command that it shows.
        text: What happens in it.
        seconds: That it takes [s] on two idle processors.
    """

    name: str
    text: str
    seconds: float


# a run's CPU seconds in all its processes are 55, 140, 15 and 25; two processors share most of them
STEPS = (
    Step("calibrate", "20 simulated stirs search for the liquid, 20 check what was found", 40),
    Step("criticise", "some 80 simulated stirs test which effect the simulator lacks", 100),
    Step("pour", f"{POURS} simulated pours choose one for the liquid with this effect", 12),
    Step("report", "six films of stirs and pours", 18),
)


class Demo(NamedTuple):
    """Results of the demo.

    Attributes:
        calibration, criticism, pour: As the run holds them.
        pour_before: What would have been poured without criticism; the run does not hold it.
        report: The page.
        seconds: That each step took [s], in order.
    """

    calibration: "Calibration"
    criticism: "Criticism"
    pour: "Pour"
    pour_before: "Pour"
    report: Path
    seconds: dict[str, float]


def run_demo(
    out: Path,
    *,
    compute: "Compute | None" = None,
    begins: Callable[[Step, float, float], None] = lambda _step, _own, _left: None,
    fitted: "Callable[[Calibration], None]" = lambda _: None,
    criticised: "Callable[[Criticism], None]" = lambda _: None,
) -> Demo:
    """Calibrate on the bundled recording, find what is hidden in it, pour and write the report.

    With an executor, the pour before criticism is chosen in a thread beside the next
    simulations. A second call takes everything that was simulated from the run.
    The page is written after each step, at first without moving pictures.

    Args:
        out: The RUN directory.
        compute: Where simulations run; None is this process.
        begins: Called with each step before it, and with `expected`.
        fitted, criticised: Called with the calibration and the criticism once the page has them.

    Raises:
        InputError: `out` holds another run.
    """
    from .inference.simulations import Compute

    out = given_path(out, Argument("out"))
    compute = compute or Compute()
    data, starts = files("bolfi_liquids.data"), list[float]()

    def begin(step: Step) -> None:
        starts.append(time.perf_counter())
        begins(step, *expected(step, starts[-1] - starts[0]))

    calibrating, criticising, choosing, reporting = STEPS
    with (
        as_file(data / RECORDING) as recording,
        as_file(data / HELD_OUT) as held_out,
        as_file(data / CLEAN) as clean,
        ThreadPoolExecutor(1) as thread,
    ):
        workers = compute.executor
        where: dict[str, Any] = {"executor": workers, "timeout": compute.timeout}
        if workers is not None:  # they load Taichi while this process loads JAX
            for _ in range(2):
                workers.submit(runtime.start)
        stir = open_recording(recording)
        _refuse_other_run(out, stir)
        begin(calibrating)
        calibration = calibrate(stir, out=out, resume=True, **where)
        report(out, moving=False)
        fitted(calibration)
        begin(criticising)
        # the fit is bad, and without criticism nobody should pour after it
        few = PourSettings(budget=POURS)
        decision = calibration, bundled_cups(), few, compute
        before = None if workers is None else thread.submit(decided, *decision)
        criticism = criticise(calibration, held_out=held_out, baseline=clean, **where)
        report(out, moving=False)
        criticised(criticism)
        # Taichi stays in this thread where there are no workers
        pour_before = decided(*decision) if before is None else before.result()
        begin(choosing)
        pour = choose_pour(criticism, budget=POURS, **where)
        begin(reporting)
        page = report(out, **where)
    ends = pairwise([*starts, time.perf_counter()])
    seconds = {step.name: end - start for step, (start, end) in zip(STEPS, ends, strict=True)}
    return Demo(calibration, criticism, pour, pour_before, page, seconds)


def expected(step: Step, spent: float) -> tuple[float, float]:
    """Seconds of a step, and those left in all, on a computer as slow as it was so far.

    Args:
        step: One of `STEPS`.
        spent: On those before it [s]. Where this is less than usual, the run held what they make.
    """
    at = STEPS.index(step)
    usual, left = (sum(one.seconds for one in part) for part in (STEPS[:at], STEPS[at:]))
    slower = max(1.0, spent / usual) if usual else 1.0
    return slower * step.seconds, slower * left


def _refuse_other_run(out: Path, stir: "Recording") -> None:
    """Raise `InputError` if `out` holds a run that the demo did not make.

    `calibrate` would name options that the demo does not have, or go on with a smaller run.
    """
    if not (out / RUN_TOML).exists():
        return
    held, own = Run.open(out).record, asdict(CalibrationSettings())
    same_data = held.get("inputs") == {"sha256": [stir.hash]}
    if not same_data or {name: held.get("settings", {}).get(name) for name in own} != own:
        raise InputError("holds another run", where=str(out), fix="choose another `out`")
