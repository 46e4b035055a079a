"""The whole way on bundled data: stir, learn, criticise, pour, report."""

from importlib.resources import as_file, files
from pathlib import Path

from .calibration.calibrate import calibrate
from .criticism.criticise import criticise
from .pouring.choose import choose_pour
from .reporting.report import report

RECORDING, CLEAN = "glycerin_v10.nc", "water_v10.nc"


def run_demo(out: Path) -> Path:
    """Calibrate on the bundled recording, criticise, choose a pour and write the report.

    A second call takes everything that was simulated from the run.

    Returns:
        The report.
    """
    data = files("bolfi_liquids.data")
    with as_file(data / RECORDING) as recording, as_file(data / CLEAN) as clean:
        calibration = calibrate(recording, out=out, resume=True)
        criticism = criticise(calibration, baseline=clean)
    choose_pour(criticism.calibration)
    return report(out)
