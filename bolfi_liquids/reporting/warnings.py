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
        outdated: Why a criticism or a pour that is there does not count.
        remedies: The command that makes each of these again.
    """

    calibration: Calibration
    criticism: Criticism | None
    pour: Pour | None
    outdated: tuple[str, ...] = ()
    remedies: tuple[str, ...] = ()

    @classmethod
    def of(cls, run: Run) -> "Results":
        """Everything that is current.

        Raises:
            InputError: There is no finished calibration.
        """
        calibration = Calibration.of(run)
        old = {step: why for step in ("criticise", "pour") if (why := run.why_not(step))}
        remedies = tuple(map(run.again, old))
        found = Criticism.of(run), Pour.of(run)
        return cls(calibration, *found, tuple(old.values()), remedies)

    @property
    def latest(self) -> Calibration:
        """What is poured: the calibration, with what a criticism accepted."""
        return self.calibration if self.criticism is None else self.criticism.calibration

    @property
    def facts(self) -> Facts:
        """All chapters of `reporting.facts`; None where there is no such result."""
        outdated = zip(self.outdated, self.remedies, strict=True)
        return {
            "calibration": calibration_facts(self.calibration),
            "latest": fit_facts(self.latest.summary),
            "criticism": self.criticism and criticism_facts(self.criticism),
            "pour": self.pour and pour_facts(self.pour),
            "outdated": [{"why": why, "remedy": remedy} for why, remedy in outdated],
        }


def warnings_of(results: Results) -> list[str]:
    """Warnings of report and terminal, the gravest first; none if nothing is known to be wrong."""
    return prose("warnings", results.facts)
