"""A fit so bad that its posterior must not be used: one rule for terminal, report and pour."""

from pathlib import Path

from ..errors import InputError
from .summary import CalibrationSummary, FitStatus

HOW_TO_POUR = "correct it and calibrate again, or choose a pour nevertheless: --force (force=True)"


def bad_fit(summary: CalibrationSummary) -> str | None:
    """What is likely wrong with a fit; None where it is as close as can be asked for.

    Args:
        summary: Of the calibration that counts, with what a criticism accepted.
    """
    if summary.fit_status is FitStatus.ACCEPTABLE:
        return None
    if summary.frame_faults:
        return f"{'; '.join(summary.frame_faults)}. Do not rely on the posterior."
    return (
        f"The fit is bad: {summary.fit_rms_deg:.2f}° RMS, of which the simulator's own error is "
        f"about {summary.simulator_error_deg:.2f}°; the rest is {summary.fit_to_noise:.1f} times "
        f"the noise of {summary.noise_deg:.2f}°. A sign, the direction of the axes, the clock, a "
        "size or a density is likely wrong, too little was simulated, or the simulator lacks an "
        "effect. Do not rely on the posterior."
    )


def refuse_bad_fit(summary: CalibrationSummary, run: Path) -> None:
    """Raise `InputError` where the fit of a run is too bad to go on with."""
    if (found := bad_fit(summary)) is not None:
        raise InputError(found.rstrip("."), where=str(run), fix=HOW_TO_POUR)
