"""What a criticism found: verdict, evidence, extended calibration, plots."""

import json
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..calibration.result import Calibration
from ..drawing import shown
from ..errors import InputError
from ..inference.criticism.verdict_kind import VerdictKind, advice
from ..inference.notebook_display import html_table
from ..inputs.prior import PARAMETERS
from ..run.run import RESULTS, Run, RunOrPath
from ..wording import spoken
from . import figures
from .summary import CriticismSummary

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from xarray import Dataset, DataTree


@dataclass(frozen=True, eq=False, repr=False)
class Criticism:
    """A finished criticism; nothing here simulates.

    The plots draw in `axes`, or in a figure of their own. They return the axes, shape
    (rows, columns).

    Attributes:
        base: The calibration that was criticised.
        tree: criticism.nc; its groups are listed in `criticism.criticism_file`.
        summary: The section "criticise" of summary.json.
    """

    base: Calibration
    tree: "DataTree"
    summary: CriticismSummary

    def __repr__(self) -> str:
        found = ", ".join((self.verdict, *self.effects))
        return f"Criticism({str(self.base.path)!r}: {found}, p = {self.summary.p_value:.2g})"

    @property
    def path(self) -> Path:
        """The RUN directory."""
        return self.base.path

    def _repr_html_(self) -> str:
        rows = {"run": self.base.path, "verdict": self.verdict, "p": f"{self.summary.p_value:.2g}"}
        rows |= {
            spoken(name): values.interval(name) for name, values in self.summary.coefficient.items()
        }
        if self.effects and not self.summary.coefficient:
            rows["effects"] = ", ".join(map(spoken, self.effects))
        return html_table("Criticism", [*rows.items(), ("next", self.advice)])

    @classmethod
    def open(cls, run: RunOrPath) -> "Criticism":
        """Read a finished criticism.

        Raises:
            InputError: There is none in the directory, or it is of another posterior.
        """
        opened = Run.open(run)
        return cls.made(Calibration.of(opened), opened.required("criticise"))

    @classmethod
    def of(cls, run: Run) -> "Criticism | None":
        """The criticism of a run; None without a current one."""
        tree = run.result("criticise")
        return None if tree is None else cls.made(Calibration.of(run), tree)

    @classmethod
    def made(cls, base: Calibration, tree: "DataTree") -> "Criticism":
        """The criticism of a calibration from its criticism.nc."""
        return cls(base, tree, CriticismSummary.from_json(json.loads(tree.attrs["summary"])))

    @property
    def made_from(self) -> dict[str, Any]:
        """Settings, and the SHA-256 of every file."""
        return json.loads(self.tree.attrs["made_from"])

    @property
    def verdict(self) -> VerdictKind:
        """The conclusion; equal to "none", "effect", "tie" or "unknown"."""
        return self.summary.verdict

    @property
    def advice(self) -> str:
        """What to do next."""
        confirmed, suggested = self.summary.held_out > 0, bool(self.summary.suggestions)
        return advice(self.verdict, confirmed=confirmed, suggested=suggested)

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that the verdict names: one, or those that are tied."""
        return self.summary.effects

    @property
    def table(self) -> "Dataset":
        """Over effects: SNR of a typical one, score, gain, p-value, coefficient, status."""
        return self.tree["stirs/effects"].to_dataset()

    @property
    def calibration(self) -> Calibration:
        """The extended calibration, with the accepted effects; the base one without."""
        if not self.summary.accepted:
            return self.base
        gap, numbers = self.summary.gap, {}
        # what is told of ties alone is of none that was accepted, and pours mend no stir
        of_a_tie = self.summary.stirs.verdict is VerdictKind.TIE and not self.summary.requested
        if gap.rms_after is not None and not of_a_tie:
            numbers = {"fit_rms_deg": gap.rms_after, "noise_deg": gap.noise}
        tree = self.base.tree.copy()
        tree["posterior"] = self.tree["posterior"]
        summary = self.base.summary.extended(
            tree["posterior"].to_dataset(),
            parameters=self.summary.parameters,
            best=self.summary.best,
            **numbers,
        )
        return replace(self.base, tree=tree, summary=summary)

    def plot_residuals(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Observed less expected against time, before and after, strokes that differ marked."""
        return shown(partial(figures.residual_plot, self._of("stirs")), axes)

    def plot_strokes(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Size of the difference by stroke, plane and speed, before and after."""
        return shown(partial(figures.stroke_plot, self._of("stirs")), axes)

    def plot_scores(self, source: str = "stirs", axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Draw how well each effect alone explains the difference."""
        return shown(partial(figures.score_plot, self._of(source)), axes)

    def plot_confusion(
        self, source: str = "stirs", axes: "ArrayLike | None" = None
    ) -> "NDArray[Any]":
        """Which effects these data cannot distinguish: cosines between their signatures."""
        return shown(partial(figures.confusion_plot, self._of(source)), axes)

    def plot_coefficient(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Posterior of the accepted effects' coefficients.

        Raises:
            ValueError: no effect was accepted.
        """
        if not self.summary.accepted:
            raise ValueError("no effect was accepted, so there is no coefficient to plot")
        return shown(partial(figures.coefficient_plot, self.tree, self.summary.accepted), axes)

    def plot_held_out(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """RMS on recordings that were not fitted, before and after.

        Raises:
            ValueError: nothing was tried on such recordings.
        """
        return shown(partial(figures.held_out_plot, self._of("stirs", "held_out")), axes)

    def plot_pours(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Observed against expected fractions of each pour, before and after.

        Raises:
            ValueError: no pours were criticised.
        """
        return shown(partial(figures.pour_residual_plot, self._of("pours")), axes)

    def _of(self, source: str, group: str = "effects") -> "DataTree":
        """The groups of "stirs" or "pours"."""
        if f"/{source}/{group}" not in self.tree.groups:
            option = group if group == "held_out" else source
            raise ValueError(f"nothing was found on {option}; criticise the run with {option}")
        return self.tree.children[source]


def calibration_to_pour(run: Run) -> Calibration:
    """The calibration of a run, extended by what a criticism accepted.

    Raises:
        InputError: The run has a criticism that is not current or has accepted an effect that this
            process does not know: what it accepted is part of what is known.
    """
    if run.why_not("criticise"):
        run.required("criticise")
    found = Criticism.of(run)
    if found is None:
        return Calibration.of(run)
    check_known(found.calibration)
    return found.calibration


def check_known(calibration: Calibration) -> None:
    """Raise InputError where a posterior has an effect that this process does not know."""
    from ..models import EFFECTS
    from ..models.effects import OWN_EFFECTS

    for name in sorted({*map(str, calibration.posterior)} - {*PARAMETERS, *EFFECTS}):
        raise InputError(
            f"there is no effect {name} here",
            where=str(calibration.path / RESULTS["criticise"]),
            fix=f"name the file that defines it in the environment variable {OWN_EFFECTS}",
        )
