"""Sentences about a criticism: which of them holds, and with which values.

Their wording is in `data/criticism_sentences.jinja`.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..criticism.source_summary import DifferingWindow, GapSummary, PourVerdict, SourceVerdict
from ..criticism.summary import CriticismSummary
from ..inference.criticism.verdict_kind import VerdictKind
from ..wording import Sentence, sentence

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from xarray import Dataset

    from ..calibration.summary import ParameterSummary

DETECTABLE_SNR = 3.0
"""Signal-to-noise ratio from which a difference can be relied upon."""

MAX_LISTED = 3
"""Windows, or effects, that a sentence lists."""


def verdict_sentence(found: CriticismSummary | SourceVerdict, data: str = "all") -> Sentence:
    """The conclusion.

    Args:
        found: On all data, or on one source.
        data: "all", "stirs" or "pours": what was compared.
    """
    values = {"data": data, "p_value": found.p_value}
    match found.verdict:
        case VerdictKind.AGREEMENT:
            return sentence("criticism.agree", **values)
        case VerdictKind.EFFECT:
            key = "criticism.effect" if found.held_out else "criticism.effect_unconfirmed"
            return sentence(key, **values, effects=found.effects)
        case VerdictKind.TIE:
            return sentence("criticism.tie", **values, effects=found.effects)
        case VerdictKind.UNKNOWN:
            if found.refuted:
                return sentence("criticism.refuted", **values, refuted=found.refuted)
            return sentence("criticism.unexplained", **values)


def stirs_sentences(summary: CriticismSummary) -> list[Sentence]:
    """The verdict on the stirs alone, where there are pours as well."""
    return [] if summary.pours is None else [verdict_sentence(summary.stirs, "stirs")]


def pours_sentences(pours: PourVerdict) -> list[Sentence]:
    """The verdict on the pours alone, and how far they are from what was expected."""
    if pours.after is None:
        gap = sentence("criticism.pour_gap_before", before=pours.before)
    else:
        gap = sentence("criticism.pour_gap", before=pours.before, after=pours.after)
    return [verdict_sentence(pours, "pours"), gap]


def requested_sentences(summary: CriticismSummary) -> list[Sentence]:
    """That effects were accepted on request."""
    names, unsupported = summary.requested, summary.unsupported
    if not names:
        return []
    if unsupported:
        key = "criticism.requested_unsupported"
        return [sentence(key, names=names, unsupported=unsupported)]
    return [sentence("criticism.requested", names=names)]


def baseline_sentences(summary: CriticismSummary) -> list[Sentence]:
    """What counts as simulator error, or a warning where there were no clean recordings."""
    found = [
        sentence("criticism.baseline", count=summary.baseline)
        if summary.baseline
        else sentence("criticism.no_baseline")
    ]
    if summary.baseline_left_out:
        found.append(sentence("criticism.not_clean", names=summary.baseline_left_out))
    return found


def considered_sentences(summary: CriticismSummary) -> list[Sentence]:
    """Which effects alone could be named, where not all could."""
    names = summary.considered
    return [sentence("criticism.considered", names=names)] if names else []


def coefficient_sentence(name: str, values: "ParameterSummary") -> Sentence:
    """How large a missing effect is, and what it is."""
    from ..models import EFFECTS

    effect = EFFECTS.get(name)
    if effect is None:
        return sentence("criticism.coefficient", name=name, values=values)
    return sentence(
        "criticism.coefficient_of_effect",
        name=name,
        values=values,
        neutral=effect.neutral,
        text=effect.text,
    )


def refit_sentences(
    summary: CriticismSummary, calibrated: "Mapping[str, ParameterSummary]"
) -> list[Sentence]:
    """The liquid's parameters with the accepted effects, beside those of the calibration."""
    return [
        sentence(
            "criticism.refit",
            accepted=summary.accepted,
            name=name,
            now=summary.parameters[name],
            before=values,
        )
        for name, values in calibrated.items()
        if summary.accepted
    ]


def superseded_sentences(summary: CriticismSummary) -> list[Sentence]:
    """What leads over to the calibration's own results, where they were extended."""
    accepted = summary.accepted
    return [sentence("criticism.superseded", accepted=accepted)] if accepted else []


def parameter_sentences(summary: CriticismSummary) -> list[Sentence]:
    """The parameters of the extended model, where there is one."""
    return [
        sentence("criticism.parameter", name=name, values=values)
        for name, values in summary.parameters.items()
        if summary.accepted
    ]


def gap_sentences(gap: GapSummary, accepted: Sequence[str]) -> list[Sentence]:
    """How far stirs and model are apart, before and after, fitted and held out."""
    known = {"noise": gap.noise, "usual": gap.usual}
    if gap.after is None:
        return [sentence("criticism.gap_before", before=gap.before, **known)]
    fitted = sentence(
        "criticism.gap", before=gap.before, after=gap.after, accepted=accepted, **known
    )
    if gap.held_out_before is None:
        return [fitted]
    held_out = sentence(
        "criticism.gap_held_out",
        before=gap.held_out_before,
        after=gap.held_out_after,
        noise=gap.held_out_noise,
        usual=gap.held_out_usual,
    )
    return [fitted, held_out]


def where_sentence(where: Sequence[DifferingWindow]) -> Sentence:
    """Where model and data differ significantly."""
    if not where:
        return sentence("criticism.nowhere")
    first = tuple(where[:MAX_LISTED])
    return sentence("criticism.where", windows=first, more=len(where) - len(first))


def held_out_sentence(held: "Dataset | None") -> Sentence:
    """Whether the explanations hold on recordings that were not fitted.

    Args:
        held: The group `held_out`; None if there is none.
    """
    if held is None:
        return sentence("criticism.nothing_held_out")
    names = held["explanation"].to_numpy()
    holds = {str(name): bool(held["holds"].sel(explanation=name)) for name in names}
    return sentence("criticism.held_out", holds=holds)


def detectable_sentence(effects: "Dataset") -> Sentence:
    """Which effects these data could reveal at their typical sizes, most visible first."""
    ranked = sorted(_numbers(effects, "snr"), key=lambda item: -item[1])
    snr = {name: value for name, value in ranked if value >= DETECTABLE_SNR}
    if not snr:
        return sentence("criticism.nothing_detectable")
    return sentence("criticism.detectable", snr=snr)


def undetectable_sentences(effects: "Dataset") -> list[Sentence]:
    """Which effects could act without being noticed."""
    names = tuple(name for name, value in _numbers(effects, "snr") if value < DETECTABLE_SNR)
    if not names:
        return []
    return [sentence("criticism.undetectable", names=names, limit=DETECTABLE_SNR)]


def untested_sentences(summary: CriticismSummary) -> list[Sentence]:
    """Which effects were not tested to the end."""
    names = summary.untested
    return [sentence("criticism.untested", names=names)] if names else []


def suggestion_sentence(summary: CriticismSummary) -> Sentence:
    """Which experiment to make next."""
    if not summary.suggestions:
        return sentence("criticism.nothing_to_distinguish")
    best = max(summary.suggestions, key=lambda one: one.snr)
    helps = best.snr >= DETECTABLE_SNR
    key = "criticism.record_next" if helps else "criticism.no_experiment_helps"
    return sentence(key, experiment=best.experiment, between=best.between, snr=best.snr)


def camera_noise_sentence(summary: CriticismSummary) -> Sentence:
    """How the cameras' noise was learned."""
    return sentence("criticism.camera_noise", noise=summary.noise)


def largest_gains_sentences(effects: "Dataset") -> list[Sentence]:
    """The effects that alone explain most, best first."""
    p_values = dict(_numbers(effects, "p_value"))
    ranked = sorted(_numbers(effects, "gain"), key=lambda item: -item[1])
    best = tuple(
        {"name": name, "gain": gain, "p_value": p_values[name]}
        for name, gain in ranked[:MAX_LISTED]
        if gain > 0.0
    )
    return [sentence("criticism.largest_gains", effects=best)] if best else []


def _numbers(effects: "Dataset", column: str) -> "Iterator[tuple[str, float]]":
    """Effect and number of each row in which the number is known."""
    names, values = effects["effect"].to_numpy(), effects[column].to_numpy()
    for name, value in zip(names, values, strict=True):
        if np.isfinite(value):
            yield str(name), float(value)
