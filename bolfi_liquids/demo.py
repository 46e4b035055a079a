"""The whole way on bundled data: stir, learn, criticise, pour, report."""

from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .calibration.calibrate import calibrate
from .criticism.criticise import criticise
from .errors import Argument
from .files import given_path
from .pouring.choose import choose_pour
from .reporting.report import report

if TYPE_CHECKING:
    from .inference.simulations import Workers

RECORDING, CLEAN = "glycerin_v10.nc", "water_v10.nc"


def run_demo(out: Path, *, executor: "Workers | None" = None, timeout: float | None = None) -> Path:
    """Calibrate on the bundled recording, criticise, choose a pour and write the report.

    A second call takes everything that was simulated from the run.

    Args:
        out: The RUN directory.
        executor, timeout: See `calibrate`.

    Returns:
        The report.
    """
    out = given_path(out, Argument("out"))
    where: dict[str, Any] = {"executor": executor, "timeout": timeout}
    data = files("bolfi_liquids.data")
    with as_file(data / RECORDING) as recording, as_file(data / CLEAN) as clean:
        calibration = calibrate(recording, out=out, resume=True, **where)
        criticism = criticise(calibration, baseline=clean, **where)
    choose_pour(criticism, **where)
    return report(out, **where)
