"""A fit so bad that its posterior must not be used: one rule for terminal, report and pour."""

from pathlib import Path

from ..errors import InputError
from ..wording import Sentence, sentence
from .summary import CalibrationSummary, FitStatus

HOW_TO_POUR = "correct it and calibrate again, or choose a pour nevertheless: --force (force=True)"


def bad_fit(summary: CalibrationSummary) -> Sentence | None:
    """What is likely wrong with a fit; None where it is as close as can be asked for.

    Args:
        summary: Of the calibration that counts, with what a criticism accepted.
    """
    if summary.fit_status is FitStatus.ACCEPTABLE:
        return None
    if summary.frame_faults:
        return sentence("calibration.wrong_frame", faults=summary.frame_faults)
    return sentence("calibration.bad_fit", summary=summary)


def refuse_bad_fit(summary: CalibrationSummary, run: Path) -> None:
    """Raise `InputError` where the fit of a run is too bad to go on with."""
    if (found := bad_fit(summary)) is not None:
        raise InputError(str(found).rstrip("."), where=str(run), fix=HOW_TO_POUR)
