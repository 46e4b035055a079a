"""The whole way on bundled data: stir, learn, find what the simulator lacks, pour, report."""

from dataclasses import asdict
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .calibration.calibrate import calibrate
from .criticism.criticise import criticise
from .errors import Argument, InputError
from .files import given_path
from .inputs.open import open_recording
from .inputs.settings import CalibrationSettings
from .pouring.choose import choose_pour
from .reporting.report import report
from .run.directory import RUN_TOML, read_run

if TYPE_CHECKING:
    from .inference.simulations import Workers
    from .inputs.recording import Recording
    from .pouring.result import Judged

RECORDING, HELD_OUT = "late_oil_v10.nc", "late_oil_v7.nc"  # the cameras were late, and say nothing
CLEAN = "clean_oil_v10.nc"  # the same strokes of an arm whose cameras were in time
POURS = 24  # that each decision's map is learned from: few, as two are made


class Demo(NamedTuple):
    """What the demo leaves besides the run.

    Attributes:
        report: The page.
        pour_before: What would have been poured without criticism.
    """

    report: Path
    pour_before: "Judged"


def run_demo(out: Path, *, executor: "Workers | None" = None, timeout: float | None = None) -> Demo:
    """Calibrate on the bundled recording, find what is hidden in it, pour and write the report.

    A second call takes everything that was simulated from the run.

    Args:
        out: The RUN directory.
        executor, timeout: See `calibrate`.

    Raises:
        InputError: `out` holds another run.
    """
    out = given_path(out, Argument("out"))
    where: dict[str, Any] = {"executor": executor, "timeout": timeout}
    data = files("bolfi_liquids.data")
    with (
        as_file(data / RECORDING) as recording,
        as_file(data / HELD_OUT) as held_out,
        as_file(data / CLEAN) as clean,
    ):
        stir = open_recording(recording)
        _refuse_other_run(out, stir)
        calibration = calibrate(stir, out=out, resume=True, **where)
        # the fit is bad, and without criticism nobody should pour after it
        before = choose_pour(calibration, pours=POURS, force=True, **where)
        criticism = criticise(calibration, held_out=held_out, baseline=clean, **where)
    choose_pour(criticism, pours=POURS, **where)
    return Demo(report(out, **where), before.chosen)


def _refuse_other_run(out: Path, stir: "Recording") -> None:
    """Raise `InputError` if `out` holds a run that the demo did not make.

    `calibrate` would name options that the demo does not have, or go on with a smaller run.
    """
    if not (out / RUN_TOML).exists():
        return
    held, own = read_run(out), asdict(CalibrationSettings())
    same_data = held.get("inputs") == {"sha256": [stir.hash]}
    if not same_data or {name: held.get("settings", {}).get(name) for name in own} != own:
        raise InputError("holds another run", where=str(out), fix="choose another `out`")
