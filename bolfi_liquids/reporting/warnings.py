"""The current results of a run, and what to consider before its pour is trusted."""

from dataclasses import dataclass

from ..calibration.result import Calibration
from ..criticism.result import Criticism
from ..pouring.result import Pour
from ..run.run import Run
from .facts import Facts, calibration_facts, criticism_facts, fit_facts, pour_facts
from .prose import prose


@dataclass(frozen=True)
class Results:
    """The current results of a run.

    Attributes:
        calibration: Without what a criticism accepted.
        criticism, pour: None where there is none of the latest posterior.
        outdated: Why a criticism or a pour that is there does not count, and what makes it again.
    """

    calibration: Calibration
    criticism: Criticism | None
    pour: Pour | None
    outdated: tuple[str, ...] = ()

    @classmethod
    def of(cls, run: Run) -> "Results":
        """Everything that is current.

        Raises:
            InputError: There is no finished calibration.
        """
        outdated = tuple(
            f"{why}; make it again: {run.again(step)}"
            for step in ("criticise", "pour")
            if (why := run.why_not(step))
        )
        return cls(Calibration.of(run), Criticism.of(run), Pour.of(run), outdated)

    @property
    def latest(self) -> Calibration:
        """Calibration that is poured by: extended by the effects that a criticism accepted."""
        return self.calibration if self.criticism is None else self.criticism.calibration

    @property
    def facts(self) -> Facts:
        """All chapters of `reporting.facts`; None where there is no such result."""
        return {
            "calibration": calibration_facts(self.calibration),
            "latest": fit_facts(self.latest.summary),
            "criticism": self.criticism and criticism_facts(self.criticism),
            "pour": self.pour and pour_facts(self.pour),
            "outdated": self.outdated,
        }


def warnings_of(results: Results) -> list[str]:
    """Warnings of report and terminal, the gravest first; none if nothing is known to be wrong."""
    return prose("warnings", results.facts)
