"""Sentences about a calibration and a pour: which of them holds, and with which values.

Their wording is in `data/calibration_sentences.jinja` and `data/pour_sentences.jinja`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..calibration.summary import CalibrationSummary, ParameterSummary, SamplerStatus
from ..pouring.result import PourSummary
from ..wording import Sentence, sentence

UNLEARNED_SHARE = 0.6
"""Share of the prior's 90 % interval above which little was learned."""

PRIOR_END = 0.02
"""Quantile of the prior; an interval that reaches it is cut off there."""

FIT_AT_NOISE, FIT_NEAR_NOISE = 1.1, 1.5
"""Times the noise up to which a fit is as close, or nearly as close, as can be expected."""

MIN_SHARE_TOLD = 0.01
"""Share of the posterior below which thin liquids are not mentioned."""


def parameter_sentence(name: str, values: ParameterSummary, prior: NDArray) -> Sentence:
    """Where a parameter lies, and whether stirring carried information about it.

    Args:
        name: Of the parameter.
        values: Of its posterior.
        prior: Draws from its prior, shape (n,).
    """
    ranks = np.searchsorted(np.sort(prior), (values.q05, values.q95)) / len(prior)
    share = float(ranks[1] - ranks[0]) / 0.9
    if share > UNLEARNED_SHARE:
        return sentence("calibration.parameter_not_learned", name=name, values=values)
    cut_off = ranks[0] < PRIOR_END or ranks[1] > 1.0 - PRIOR_END
    key = "calibration.parameter_at_the_end" if cut_off else "calibration.parameter"
    return sentence(key, name=name, values=values, share=share)


def fit_sentence(summary: CalibrationSummary) -> Sentence:
    """How close simulations at posterior draws come, compared with noise and simulator's error."""
    fit, noise = summary.fit_rms_deg, summary.noise_deg
    if fit <= FIT_AT_NOISE * noise:
        return sentence("calibration.fit_at_noise", summary=summary)
    if fit <= FIT_NEAR_NOISE * noise:
        return sentence("calibration.fit_near_noise", summary=summary, ratio=fit / noise)
    if summary.unexplained_deg <= FIT_NEAR_NOISE * noise:
        return sentence("calibration.fit_within_error", summary=summary)
    return sentence("calibration.fit_above_noise", summary=summary)


def model_error_sentence(summary: CalibrationSummary) -> Sentence:
    """Which error of the simulator the intervals allow for."""
    return sentence("calibration.model_error", summary=summary)


def sampler_sentences(summary: CalibrationSummary) -> list[Sentence]:
    """A warning where the draws cannot be relied upon."""
    if summary.sampler_status is SamplerStatus.CONVERGED:
        return []
    return [sentence("calibration.not_converged", summary=summary)]


def surrogate_sentences(summary: CalibrationSummary) -> list[Sentence]:
    """The warnings of the surrogate's own checks."""
    return [
        sentence("calibration.surrogate_in_doubt", text=text) for text in summary.emulator_warnings
    ]


def least_viscosity_sentences(summary: CalibrationSummary) -> list[Sentence]:
    """That thin liquids cannot be distinguished, where the liquid may be one of them."""
    share = summary.below_least_viscosity
    if share < MIN_SHARE_TOLD:
        return []
    least = summary.least_viscosity
    return [sentence("calibration.least_viscosity", least=least, share=share)]


def pour_sentence(summary: PourSummary) -> Sentence:
    """The chosen pour, and what it is expected to spill."""
    return sentence("pour.chosen", summary=summary)


def fate_sentences(summary: PourSummary) -> list[Sentence]:
    """What arrives and what stays; older versions did not keep it."""
    return [] if summary.expected_received is None else [sentence("pour.fate", summary=summary)]


def given_sentences(summary: PourSummary) -> list[Sentence]:
    """Which given pours count, and how they have moved the choice."""
    given = summary.given
    if given is None:
        return []
    moved = given.without.action != summary.action
    more = [sentence("pour.given_moved", without=given.without)] if moved else []
    return [sentence("pour.given", given=given), *more]


def plug_in_sentence(summary: PourSummary) -> Sentence:
    """What the best action at theta* alone would spill."""
    if summary.plug_in.action == summary.action:
        return sentence("pour.plug_in_same")
    return sentence("pour.plug_in", plug_in=summary.plug_in)


def contact_angle_sentences(cups: Mapping[str, Any]) -> list[Sentence]:
    """How the liquid was taken to wet the source, by `Cups.settings`; older pours had no angle."""
    degrees = cups["source"].get("contact_angle_deg")
    return [] if degrees is None else [sentence("pour.contact_angle", degrees=degrees)]


def map_sentences(summary: PourSummary) -> list[Sentence]:
    """From how many pours was learned where the liquid lands, and how well; older versions did
    not learn it."""
    return [] if summary.map_error is None else [sentence("pour.map", summary=summary)]
