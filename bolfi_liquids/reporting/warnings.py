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
from ..criticism.result import Criticism, criticism_of
from ..criticism.summary import CriticismSummary
from ..criticism.verdict import Verdict
from ..pouring.draining import TENTH
from ..pouring.result import Pour, PourSummary, pour_of
from ..pouring.spillage import ACTION
from ..run.given_pours import digest_of_pours
from ..wording import LEAST_SPILLED, Sentence, sentence
from .criticism_sentences import verdict_sentence
from .sentences import (
    FIT_NEAR_NOISE,
    least_viscosity_sentences,
    sampler_sentences,
    surrogate_sentences,
)

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

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
    """What a run holds.

    Attributes:
        calibrated, criticised, poured: Sections of summary.json; None where there is none.
        latest: Of the calibration that is poured, with what a criticism accepted.
        pour: pour.nc; None where there is none.
        given: Digest of the pours that the run was given; "" without any.
        posterior: Draws of the latest calibration.
        searched: Number of simulations at points that were chosen by what was learned.
    """

    calibrated: CalibrationSummary
    latest: CalibrationSummary
    criticised: CriticismSummary | None
    poured: PourSummary | None
    pour: "DataTree | None"
    given: str
    posterior: "Dataset"
    searched: int


def results_of(
    calibration: Calibration, criticism: Criticism | None = None, pour: Pour | None = None
) -> Results:
    """What the run of a calibration holds.

    Args:
        calibration: Without what a criticism accepted.
        criticism, pour: Of its run; read if they are not given, where there are any.

    Raises:
        InputError: A file is damaged, or of another version.
    """
    criticism, pour = criticism or criticism_of(calibration), pour or pour_of(calibration.path)
    summary = calibration.summary
    latest = calibration if criticism is None else criticism.calibration
    return Results(
        calibrated=summary,
        latest=latest.summary,
        criticised=None if criticism is None else criticism.summary,
        poured=None if pour is None else pour.summary,
        pour=None if pour is None else pour.tree,
        given=digest_of_pours(calibration.path),
        posterior=latest.posterior,
        searched=summary.n_simulations - int(calibration.tree.attrs["initial"]),
    )


def warnings_of(run: Results) -> list[Sentence]:
    """The gravest first; none if nothing is known to be wrong."""
    return [
        *filter(None, [bad_fit(run.latest)]),
        *sampler_sentences(run.latest),
        *surrogate_sentences(run.calibrated),
        *_of_the_search(run.calibrated, run.searched),
        *stale_sentences(run),
        *_of_the_model(run.calibrated, run.criticised),
        *least_viscosity_sentences(run.latest),
        *_of_the_pour(run.poured, run.pour),
    ]


def _of_the_search(calibrated: CalibrationSummary, searched: int) -> list[Sentence]:
    if searched >= MIN_SEARCHED:
        return []
    return [sentence("warning.no_search", total=calibrated.n_simulations, searched=searched)]


def stale_sentences(run: Results) -> list[Sentence]:
    """That the pour was chosen over another posterior than the latest, or with other given pours
    than the run holds, where it was."""
    if run.pour is None:
        return []
    found = []
    if not was_poured_over(run.pour, run.posterior):
        found.append(sentence("warning.stale_pour"))
    if run.pour.attrs.get("given_pours", "") != run.given:
        found.append(sentence("warning.stale_given"))
    return found


def was_poured_over(pour: "DataTree", posterior: "Dataset") -> bool:
    """Whether a pour was chosen over draws of this posterior."""
    liquids = pour["liquids"].to_dataset()
    if set(liquids.data_vars) != set(posterior.data_vars):
        return False
    return all(np.isin(liquids[name], posterior[name]).all() for name in liquids.data_vars)


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
    if criticised.verdict != Verdict.NONE and not confirmed:
        found.append(verdict_sentence(criticised))
    if criticised.verdict != Verdict.UNKNOWN:  # what one source named explains nothing of the other
        sources = {"stirs": criticised.stirs, "pours": criticised.pours}
        found += [
            verdict_sentence(one, data)
            for data, one in sources.items()
            if one is not None and one.verdict == Verdict.UNKNOWN
        ]
    if not criticised.baseline:
        found.append(sentence("criticism.no_baseline"))
    return found


def _of_the_pour(poured: PourSummary | None, pour: "DataTree | None") -> list[Sentence]:
    if poured is None or pour is None:
        return []
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
