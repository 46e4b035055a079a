"""The whole way on bundled data: stir, learn, pour, report."""

from importlib.resources import as_file, files
from pathlib import Path

from .calibrator import calibrate
from .pouring import choose_pour
from .reporting import report

RECORDING = "glycerin_v10.nc"


def run_demo(out: Path) -> Path:
    """Calibrate on the bundled recording, choose a pour and write the report.

    A second call takes everything that was simulated from the run.

    Returns:
        The report.
    """
    with as_file(files("bolfi_liquids.data") / RECORDING) as recording:
        calibration = calibrate(recording, out=out, resume=True)
    choose_pour(calibration)
    return report(out)
