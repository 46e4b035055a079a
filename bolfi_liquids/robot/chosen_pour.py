"""The chosen pour, checked for execution."""

import json
from dataclasses import dataclass

import numpy as np

from ..calibration.bad_fit import bad_fit
from ..calibration.summary import FitStatus
from ..errors import InputError
from ..inputs.cups import kept_cups
from ..models import Cups
from ..pouring.result import Judged, Pour
from ..reporting.warnings import Results, warnings_of
from ..run.run import RESULTS, Run
from ..wording import at_most, spilled

ROUNDING = 1e-9  # relative, of an action that was written and read again
BAD_FIT = "it was chosen over a bad fit: an arm carries it out with --despite-bad-fit only"


@dataclass(frozen=True)
class ChosenPour:
    """What is to be carried out, and what a person should know before it is.

    Attributes:
        run: The run that has chosen it.
        judged: The action and what it spills.
        cups: For which it was chosen.
        fit_is_bad: Whether the fit was, or is, so bad that the pour could only be chosen by force.
        warnings: The report's.
    """

    run: Run
    judged: Judged
    cups: Cups
    fit_is_bad: bool
    warnings: tuple[str, ...]

    def check_fit(self, *, despite_bad_fit: bool) -> None:
        """Refuse a pour that was chosen over a posterior whose fit is bad.

        Args:
            despite_bad_fit: Whether a person has allowed it nevertheless.

        Raises:
            InputError: It is one, and nobody has.
        """
        if self.fit_is_bad and not despite_bad_fit:
            raise InputError(
                "its pour was chosen over a bad fit, and an arm refuses it",
                where=str(self.run.path),
                fix="correct the recording, calibrate and choose again, or pour nevertheless: "
                "--despite-bad-fit (despite_bad_fit=True)",
            )

    def __str__(self) -> str:
        """As a person reads it before the motion, what is wrong first."""
        return "\n".join([*([BAD_FIT] if self.fit_is_bad else []), self.expected])

    @property
    def expected(self) -> str:
        """The action, what it spills, and the report's warnings."""
        chosen = self.judged
        return "\n".join(
            [
                f"the pour that {self.run.path} has chosen: "
                f"{np.degrees(chosen.angular_velocity):.1f} deg/s, the lip "
                f"{100 * chosen.distance:.2f} cm from the receiver's axis",
                f"expected to spill {spilled(chosen.expected_spillage)}, "
                f"{at_most(chosen.spillage_q95)} in 95 % of outcomes",
                *(f"warning: {one}" for one in self.warnings),
            ]
        )


def chosen_pour(run: Run) -> ChosenPour:
    """The pour of a run, from pour.nc.

    Raises:
        InputError: The run has chosen none over its latest posterior and given pours, or one that
            lies outside of what its cups allow.
    """
    pour = Pour.made(run, run.required("pour"))
    results = Results.of(run)
    chosen, cups = pour.chosen, kept_cups(json.loads(pour.tree.attrs["cups"]))
    _check_ranges(run, chosen, cups)
    was_bad = pour.summary.fit_status is FitStatus.BAD
    is_bad = was_bad or bad_fit(results.latest.summary) is not None
    return ChosenPour(run, chosen, cups, is_bad, tuple(warnings_of(results)))


def _check_ranges(run: Run, chosen: Judged, cups: "Cups") -> None:
    """Refuse an action that was never to be chosen."""
    checked = (
        ("angular_velocity", cups.angular_velocity_range, "rad/s"),
        ("distance", cups.distance_range, "m"),
    )
    for name, (low, high), unit in checked:
        value, slack = getattr(chosen, name), ROUNDING * max(abs(low), abs(high))
        if not low - slack <= value <= high + slack:
            raise InputError(
                f"{name} {value:g} {unit} is outside of {low:g} to {high:g} {unit}, which the "
                "cups allow",
                where=str(run.path / RESULTS["pour"]),
                fix=run.again("pour"),
            )
