"""Warnings of report and terminal: what to consider before a run's pour is trusted.

Their wording is in `data/warning_sentences.jinja`.
"""

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..calibration.bad_fit import bad_fit
from ..calibration.result import Calibration
from ..calibration.summary import CalibrationSummary
from ..criticism.result import Criticism
from ..criticism.summary import CriticismSummary
from ..inference.criticism.verdict_kind import VerdictKind
from ..pouring.draining import TENTH
from ..pouring.result import Pour
from ..pouring.spillage import ACTION
from ..run.run import Run
from ..wording import LEAST_SPILLED, Sentence, sentence
from .criticism_sentences import verdict_sentence
from .sentences import (
    FIT_NEAR_NOISE,
    least_viscosity_sentences,
    sampler_sentences,
    surrogate_sentences,
)

if TYPE_CHECKING:
    from xarray import DataTree

MIN_SEARCHED = 3
"""Simulations that the engine chose, of which fewer are no search."""

MUCH_SPILLED = 0.05
"""Expected spillage that a person would mop up."""

PRIOR_ENDS = {
    ("angular_velocity", 0): "slowest",
    ("angular_velocity", 1): "fastest",
    ("distance", 0): "nearest",
    ("distance", 1): "farthest",
}
"""What an action at either end of the range of each quantity is called."""


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


def warnings_of(run: Results) -> list[Sentence]:
    """The gravest first; none if nothing is known to be wrong."""
    summary, latest = run.calibration.summary, run.latest.summary
    searched = summary.n_simulations - int(run.calibration.tree.attrs["initial"])
    return [
        *filter(None, [bad_fit(latest)]),
        *sampler_sentences(latest),
        *surrogate_sentences(summary),
        *_of_the_search(summary, searched),
        *outdated_sentences(run),
        *_of_the_model(summary, run.criticism and run.criticism.summary),
        *least_viscosity_sentences(latest),
        *([] if run.pour is None else _of_the_pour(run.pour)),
    ]


def outdated_sentences(run: Results) -> list[Sentence]:
    """Names of stale results, and the command for each."""
    return [
        sentence("warning.outdated", why=why, remedy=remedy)
        for why, remedy in zip(run.outdated, run.remedies, strict=True)
    ]


def _of_the_search(calibrated: CalibrationSummary, searched: int) -> list[Sentence]:
    if searched >= MIN_SEARCHED:
        return []
    return [sentence("warning.no_search", total=calibrated.n_simulations, searched=searched)]


def _of_the_model(
    calibrated: CalibrationSummary, criticised: CriticismSummary | None
) -> list[Sentence]:
    if criticised is None:
        if calibrated.unexplained_deg > FIT_NEAR_NOISE * calibrated.noise_deg:
            return [sentence("warning.misfit_not_criticised")]
        return [sentence("warning.not_criticised")]
    found = []
    if criticised.frame_faults:
        found.append(sentence("warning.compared_in_a_wrong_frame", faults=criticised.frame_faults))
    # an effect can take up any error that looks like it, also the simulator's own
    confirmed = criticised.accepted and criticised.held_out
    if criticised.verdict != VerdictKind.AGREEMENT and not confirmed:
        found.append(verdict_sentence(criticised))
    # what one source named explains nothing of the other
    if criticised.verdict != VerdictKind.UNKNOWN:
        sources = {"stirs": criticised.stirs, "pours": criticised.pours}
        found += [
            verdict_sentence(one, data)
            for data, one in sources.items()
            if one is not None and one.verdict == VerdictKind.UNKNOWN
        ]
    if not criticised.baseline:
        found.append(sentence("criticism.no_baseline"))
    return found


def _of_the_pour(chosen: Pour) -> list[Sentence]:
    poured, pour = chosen.summary, chosen.tree
    found = _of_the_edge(pour) if poured.spillage_q95 >= LEAST_SPILLED else []
    if poured.expected_spillage > MUCH_SPILLED:
        found.append(sentence("warning.much_spilled", share=poured.expected_spillage))
    if poured.given is not None and poured.given.contradicting is not None:
        found.append(sentence("warning.given_contradict", pour=poured.given.contradicting))
    retained = float(pour["chosen"].to_dataset()["retained"].mean())
    if retained > TENTH:
        held = json.loads(pour.attrs["cups"])["pour"]["hold"]
        more = {"share": retained, "held": held, "hold": poured.hold}
        found.append(sentence("warning.much_retained", **more))
    return found


def _of_the_edge(pour: "DataTree") -> list[Sentence]:
    """That the chosen pour is at an end of what was allowed, where a better one may be beyond."""
    actions, chosen = pour["actions"], pour["chosen"].attrs
    ends = tuple(
        PRIOR_ENDS[name, end]
        for name in ACTION
        for end, limit in enumerate(actions[name].to_numpy()[[0, -1]])
        if np.isclose(chosen[name], limit)
    )
    return [sentence("warning.at_the_edge", ends=ends)] if ends else []
