"""The pour that a run has chosen, as far as an arm may carry it out."""

import json
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..calibration.bad_fit import bad_fit
from ..calibration.former_model import refuse_other_model
from ..calibration.result import Calibration
from ..calibration.summary import FitStatus
from ..errors import InputError
from ..inputs.cups import kept_cups
from ..pouring.result import ActionSummary, Judged, Pour, PourSummary, check_poured
from ..reporting.warnings import results_of, stale_sentences, warnings_of
from ..run.directory import POUR, RUN_TOML
from ..run.summary import SUMMARY_FILE
from ..wording import Sentence, at_most, command, spilled

if TYPE_CHECKING:
    from xarray import DataTree

    from ..models import Cups

ROUNDING = 1e-9  # relative, of an action that was written and read again
GROUPS = ("actions", "chosen", "plug_in", "liquids")
"""Of pour.nc, from which plan and warnings are made."""
BAD_FIT = "it was chosen over a bad fit: an arm carries it out with --despite-bad-fit only"


@dataclass(frozen=True)
class ChosenPour:
    """What is to be carried out, and what a person should know before it is.

    Attributes:
        run: The RUN directory.
        judged: The action and what it spills, as pour.nc has them.
        cups: For which it was chosen.
        stale: That it was chosen over another posterior than the latest, or with other given pours;
            empty if it was not.
        fit_is_bad: Whether the fit was, or is, so bad that the pour could only be chosen by force.
        worries: The report's other warnings.
    """

    run: Path
    judged: Judged
    cups: "Cups"
    stale: tuple[Sentence, ...]
    fit_is_bad: bool
    worries: tuple[Sentence, ...]

    def check_fresh(self) -> None:
        """Refuse a pour of another posterior than the latest, or of other given pours.

        Raises:
            InputError: It is one.
        """
        if self.stale:
            raise InputError(
                "its pour is out of date: posterior or given pours have changed since",
                where=str(self.run),
                fix=_again(self.run),
            )

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
                where=str(self.run),
                fix="correct the recording, calibrate and choose again, or pour nevertheless: "
                "--despite-bad-fit (despite_bad_fit=True)",
            )

    def __str__(self) -> str:
        """As a person reads it before the motion, what is wrong first."""
        return "\n".join([*self.wrong, self.expected])

    @property
    def wrong(self) -> list[str]:
        """Why an arm refuses it; nothing if it does not."""
        return [*map(str, self.stale), *([BAD_FIT] if self.fit_is_bad else [])]

    @property
    def expected(self) -> str:
        """The action, what it spills, and the report's warnings."""
        chosen = self.judged
        return "\n".join(
            [
                f"the pour that {self.run} has chosen: "
                f"{np.degrees(chosen.angular_velocity):.1f} deg/s, the lip "
                f"{100 * chosen.distance:.2f} cm from the receiver's axis",
                f"expected to spill {spilled(chosen.expected_spillage)}, "
                f"{at_most(chosen.spillage_q95)} in 95 % of outcomes",
                *(f"warning: {worry}" for worry in self.worries),
            ]
        )


def chosen_pour(run: Path) -> ChosenPour:
    """The pour of a run, from pour.nc.

    Raises:
        InputError: The run has chosen none or is of another model, a file is damaged, or the pour
            is not that of summary.json or lies outside of what its cups allow.
    """
    if not (run / RUN_TOML).exists() and not (run / POUR).exists():
        raise InputError(
            "no run", where=str(run), fix="calibrate first: bolfi-liquids calibrate RECORDING"
        )
    check_poured(run)
    calibration = Calibration.open(run)
    refuse_other_model(calibration)
    pour = Pour.open(run)
    results = results_of(calibration, None, pour)
    chosen, cups = pour.chosen, _kept_cups(run, pour.tree)
    _check_summary(run, pour.summary, chosen)
    _check_ranges(run, chosen, cups)
    stale = stale_sentences(results)
    worries = [one for one in warnings_of(results) if one not in stale]
    # older versions wrote no status; the pour is of the latest fit, or stale anyway
    was_bad = pour.tree.attrs.get("fit_status") == FitStatus.BAD
    is_bad = was_bad or bad_fit(results.latest) is not None
    return ChosenPour(run, chosen, cups, tuple(stale), is_bad, tuple(worries))


def _kept_cups(run: Path, tree: "DataTree") -> "Cups":
    """The cups that the action of pour.nc was chosen for."""
    try:
        for group in GROUPS:
            tree[group]  # KeyError, if it is not there
        return kept_cups(json.loads(tree.attrs["cups"]))
    except (KeyError, TypeError, ValueError) as err:
        raise InputError(
            "damaged, it holds no whole pour", where=str(run / POUR), fix=_again(run)
        ) from err


def _check_summary(run: Path, told: PourSummary, chosen: Judged) -> None:
    """Refuse a pour that a person has read about otherwise."""
    held = ActionSummary.of(chosen)
    for field in fields(ActionSummary):
        written, kept = getattr(told, field.name), getattr(held, field.name)
        if written is None:  # by an older version
            continue
        if not math.isclose(written, kept, rel_tol=ROUNDING, abs_tol=ROUNDING):
            raise InputError(
                f"pour.{field.name} is {written:g}, but {kept:g} in {POUR}",
                where=str(run / SUMMARY_FILE),
                fix=_again(run),
            )


def _check_ranges(run: Path, chosen: Judged, cups: "Cups") -> None:
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
                where=str(run / POUR),
                fix=_again(run),
            )


def _again(run: Path) -> str:
    return f"choose the pour again: {command('pour', run)}"
