"""What a criticism found: verdict, evidence, extended calibration, plots."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..calibration.posterior_file import read_tree
from ..calibration.result import Calibration
from ..calibration.summary import Fitted
from ..drawing import given_or_shown
from ..errors import InputError
from ..run.directory import CRITICISM, CRITICISM_FORMAT, Run, run_path
from ..run.summary import SUMMARY_FILE, made_by, read_summary
from ..wording import command, html_table, sentence, spoken
from .summary import CriticismSummary
from .verdict import Verdict

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
            spoken(name): sentence("criticism.interval", name=name, values=values)
            for name, values in self.summary.coefficient.items()
        }
        if self.effects and not self.summary.coefficient:
            rows["effects"] = ", ".join(map(spoken, self.effects))
        return html_table("Criticism", rows | {"next": self.verdict.advice})

    @classmethod
    def open(cls, run: str | Path) -> "Criticism":
        """Read a finished criticism.

        Raises:
            InputError: There is none in the directory, or not one whole of this version's form.
        """
        run = run_path(run)
        if (found := criticism_of(Calibration.open(run))) is None:
            raise InputError(
                "the calibration in it was not criticised",
                where=str(run),
                fix=f"run: {command('criticise', run)}",
            )
        return found

    @property
    def verdict(self) -> Verdict:
        """The conclusion; equal to "none", "effect", "tie" or "unknown"."""
        return self.summary.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """What the verdict names: the effect, or those that are tied."""
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
        tree = self.base.tree.copy()
        tree["posterior"] = self.tree["posterior"]
        posterior = tree["posterior"].to_dataset()
        summary = self.base.summary.of_posterior(
            posterior, self.summary.parameters, self.summary.best, self._fitted
        )
        return replace(self.base, tree=tree, summary=summary)

    @property
    def _fitted(self) -> Fitted:
        """How near the accepted effects bring the model to the stirs.

        Effects that pours alone have shown bring it no nearer; what is told then is of ties.
        """
        gap, before = self.summary.gap, self.base.summary
        of_a_tie = self.summary.stirs.verdict is Verdict.TIE and not self.summary.requested
        if gap.rms_after is None or of_a_tie:
            return Fitted(before.fit_rms_deg, before.noise_deg)
        return Fitted(gap.rms_after, gap.noise)

    def plot_residuals(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Observed less expected against time, before and after, strokes that differ marked."""
        from .figures import residual_plot

        return residual_plot(self.tree.children["stirs"], given_or_shown(axes)).grid

    def plot_strokes(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Size of the difference by stroke, plane and speed, before and after."""
        from .figures import stroke_plot

        return stroke_plot(self.tree.children["stirs"], given_or_shown(axes)).grid

    def plot_scores(self, source: str = "stirs", axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """How well each effect alone would explain the difference."""
        from .effect_figures import score_plot

        return score_plot(self.tree.children[source], given_or_shown(axes)).grid

    def plot_confusion(
        self, source: str = "stirs", axes: "ArrayLike | None" = None
    ) -> "NDArray[Any]":
        """Which effects these data cannot distinguish: cosines between their signatures."""
        from .effect_figures import confusion_plot

        return confusion_plot(self.tree.children[source], given_or_shown(axes)).grid

    def plot_coefficient(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Posterior of the accepted effects' coefficients.

        Raises:
            ValueError: no effect was accepted.
        """
        from .effect_figures import coefficient_plot

        if not self.summary.accepted:
            raise ValueError("no effect was accepted, so there is no coefficient to plot")
        return coefficient_plot(self.tree, self.summary.accepted, given_or_shown(axes)).grid

    def plot_held_out(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """RMS on recordings that were not fitted, before and after.

        Raises:
            ValueError: nothing was tried on such recordings.
        """
        from .figures import held_out_plot

        if "held_out" not in self.tree["stirs"].children:
            raise ValueError(
                "no explanation was tested on held-out recordings; criticise the run with held_out"
            )
        return held_out_plot(self.tree.children["stirs"], given_or_shown(axes)).grid

    def plot_pours(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Observed against expected fractions of each pour, before and after.

        Raises:
            ValueError: no pours were criticised.
        """
        from .figures import pour_residual_plot

        if "pours" not in self.tree.children:
            raise ValueError("no pours were criticised; criticise the run with pours")
        return pour_residual_plot(self.tree.children["pours"], given_or_shown(axes)).grid


def criticism_of(base: Calibration) -> Criticism | None:
    """What was found out about a calibration; None if its run holds no finished criticism.

    Raises:
        InputError: It does, but damaged, in part, or in the form of another version.
    """
    run = base.path
    section = read_summary(run).get(CriticismSummary.SECTION)
    if section is None:
        return None
    if (section.get("made_from") or {}).get("format") != CRITICISM_FORMAT:
        raise InputError(
            f"its criticism has the form of {made_by(section)}",
            where=str(run),
            fix=f"{_again(run)}, or use that version",
        )
    if not (run / CRITICISM).is_file():
        return None
    tree = read_tree(run / CRITICISM, fix=_again(run))
    summary = CriticismSummary.from_json(section, str(run / SUMMARY_FILE))
    if json.loads(tree.attrs.get("made_from", "null")) != summary.made_from:
        raise InputError(
            f"is of another criticism than the section in {SUMMARY_FILE}: a call was killed",
            where=str(run / CRITICISM),
            fix=_again(run),
        )
    return Criticism(base, tree, summary)


def finished_criticism(base: Calibration, made_from: Mapping[str, Any]) -> Criticism | None:
    """The criticism of a calibration if it was finished and made from just this; else None."""
    read_summary(base.path)  # a damaged one is refused now, not after the simulations
    try:
        found = criticism_of(base)
    except InputError:  # of another version, damaged or unfinished: it is made again
        return None
    return found if found and found.summary.made_from == made_from else None


def _again(run: Path) -> str:
    return f"write it again: {command('criticise', run)}"


def base_calibration(given: "Run") -> Calibration:
    """The calibration of a run, without what a criticism accepted; read if it is not given."""
    if isinstance(given, Criticism):
        return given.base
    if isinstance(given, Calibration) and not given.added:
        return given
    return Calibration.open(run_path(given))


def latest_calibration(given: "Run") -> Calibration:
    """The calibration of a run, extended by what a criticism accepted.

    Args:
        given: A calibration, which is returned as it is; a criticism; or a RUN directory.
    """
    if isinstance(given, Calibration):
        return given
    if isinstance(given, Criticism):
        return given.calibration
    calibration = base_calibration(given)
    found = criticism_of(calibration)
    return calibration if found is None else found.calibration
