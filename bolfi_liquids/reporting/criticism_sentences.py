"""What a criticism found, in plain sentences."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .sentences import UNITS

if TYPE_CHECKING:
    from xarray import Dataset

SEEN = 3.0  # signal-to-noise ratio from which a difference can be relied upon
NAMED = 3  # windows that a sentence lists
NO_BASELINE = "Without clean recordings (--baseline) the residual may be the simulator's own."


def words(name: str) -> str:
    """An effect's or an explanation's name as it is spoken."""
    return name.replace("_", " ")


def unit_of(name: str) -> str:
    """Unit of an effect's coefficient or of a liquid's parameter; "" if it has none."""
    from ..models import EFFECTS

    unit = EFFECTS[name].unit if name in EFFECTS else UNITS.get(name, "")
    return "" if unit == "1" else unit


def with_unit(name: str, value: float) -> str:
    """A coefficient or a parameter to three digits, with its unit."""
    return f"{value:.3g} {unit_of(name)}".strip()


def interval(name: str, values: Mapping[str, float]) -> str:
    """Median and 90 % interval of a coefficient or a parameter."""
    middle = with_unit(name, values["q50"])
    return f"{middle} (90 %: {values['q05']:.3g} to {values['q95']:.3g})"


def listed(names: Sequence[str], last: str = "and") -> str:
    """ "a", "a and b", "a, b and c"."""
    spoken = [words(name) for name in names]
    return f" {last} ".join(part for part in (", ".join(spoken[:-1]), spoken[-1]) if part)


def verdict_sentence(section: Mapping[str, Any]) -> str:
    """The conclusion; from the section "criticise" of summary.json, or its "stirs" or "pours"."""
    refuted = section["refuted"]
    kind, effects, p = section["verdict"], section["effects"], f"p = {section['p_value']:.2g}"
    if kind == "none":
        return f"Simulation and data agree ({p}): nothing is known to be missing."
    differ = f"Simulation and data differ ({p})"
    if kind == "effect":
        missing = "the missing effect" if len(effects) == 1 else "the missing effects"
        if not section["held_out"]:
            return f"{differ}: {missing} may be {listed(effects)}; no data held out confirm it."
        return f"{differ}: {missing} {'is' if len(effects) == 1 else 'are'} {listed(effects)}."
    if kind == "tie":
        return (
            f"{differ}: the missing effect is {listed(effects, 'or')}, and these data cannot say"
            " which."
        )
    if refuted:
        verb = "explains" if len(refuted) == 1 else "explain"
        return (
            f"{differ}: {listed(refuted, 'or')} {verb} these data, but data held out do not bear it"
            " out, so what is missing is not known."
        )
    return f"{differ}, and no known effect explains it: what is missing is not known."


def stirs_sentence(section: Mapping[str, Any]) -> str:
    """The verdict on the stirs alone, where there are pours as well; else empty."""
    if section["pours"] is None:
        return ""
    return verdict_sentence(section["stirs"]).replace(
        "Simulation and data", "Simulated and real stirs"
    )


def accepted_sentence(section: Mapping[str, Any]) -> str:
    """That someone accepted effects whatever the verdict; empty if nobody did."""
    if not section["requested"]:
        return ""
    names = listed(section["requested"])
    sentence = f"{names.capitalize()} joined the model on request (--accept)"
    if section["unsupported"]:
        return f"{sentence}, although these data do not bear out {listed(section['unsupported'])}."
    return f"{sentence}, whatever the verdict."


def baseline_sentence(section: Mapping[str, Any]) -> str:
    """What the verdict owes to clean recordings, or a warning where there were none."""
    count, left_out = section["baseline"], section["baseline_left_out"]
    recordings = "clean recording" if count == 1 else "clean recordings"
    sentence = (
        f"What the simulator gets wrong on {count} {recordings} as well counts as its own and not"
        " as a missing effect."
        if count
        else NO_BASELINE
    )
    if not left_out:
        return sentence
    return f"{sentence} Not counted as clean, but looked at: {', '.join(left_out)}."


def considered_sentence(section: Mapping[str, Any]) -> str:
    """Which effects alone could be named; empty if all of them."""
    considered = section["made_from"]["settings"]["effects"]
    return f"Only {listed(considered)} could be named (--effects)." if considered else ""


def coefficient_sentence(name: str, values: Mapping[str, float]) -> str:
    """How large a missing effect is, and what it is."""
    from ..models import EFFECTS

    sentence = (
        f"{words(name).capitalize()} is probably between {with_unit(name, values['q05'])} and"
        f" {with_unit(name, values['q95'])} (90 %), median {with_unit(name, values['q50'])}"
    )
    effect = EFFECTS.get(name)
    if effect is None:
        return f"{sentence}."
    return f"{sentence}; {with_unit(name, effect.neutral)} would be no effect. {effect.text}"


def refit_sentences(section: Mapping[str, Any], calibrated: Mapping[str, Any]) -> list[str]:
    """What the liquid is with the accepted effects, beside what it was thought to be.

    Args:
        section: "criticise" of summary.json.
        calibrated: Its section "calibrate".
    """
    if not section["accepted"]:
        return []
    names, now = listed(section["accepted"]), section["parameters"]
    return [
        f"With {names}, {name} is {interval(name, now[name])} instead of {interval(name, values)}."
        for name, values in calibrated["parameters"].items()
    ]


def superseded_sentence(section: Mapping[str, Any]) -> str:
    """What leads over to the calibration's own results; empty where they still stand."""
    if not section["accepted"]:
        return ""
    return f"The calibration itself, without {listed(section['accepted'])}, had found:"


def gap_sentence(section: Mapping[str, Any]) -> str:
    """How far the stirs and the model are apart, before and after, fitted and held out."""
    gap = section["gap_deg"]
    noise = f"the noise of cameras and simulator is {gap['noise']:.2f}°."
    sentence = f"Beyond noise, recorded and expected inclination differ by {gap['before']:.2f}° RMS"
    if gap["after"] is None:
        return f"{sentence}; {noise}"
    explained = listed(section["accepted"]) if section["accepted"] else "the best explanation"
    sentence = f"{sentence}, and with {explained} by {gap['after']:.2f}°"
    if gap["held_out_before"] is None:
        return f"{sentence}; {noise}"
    return (
        f"{sentence}. On recordings held out, to which nothing was fitted, it is"
        f" {gap['held_out_before']:.2f}° before and {gap['held_out_after']:.2f}° after; {noise}"
        f" On those held out it is {gap['held_out_noise']:.2f}°."
    )


def window(found: Mapping[str, Any]) -> str:
    """Where a window is: stroke, plane and time, or speed."""
    if "speed" in found:
        return f"at {found['speed']} ({found['recording']})"
    number = found["stroke"]
    stroke = f"in stroke {number}" if number else "before the first stroke"
    time = f"{found['start_s']:.1f} to {found['stop_s']:.1f} s"
    return f"{stroke}, {found['channel']} plane, {time} ({found['recording']})"


def where_sentence(section: Mapping[str, Any]) -> str:
    """Where model and data surely differ."""
    where = section["where"]
    if not where:
        return "In no stroke, plane or range of speeds alone is the difference sure."
    first = [
        f"{window(found)}: {found['rms_deg']:.2f}° RMS, p = {found['p_value']:.2g}"
        for found in where[:NAMED]
    ]
    rest = len(where) - len(first)
    more = f"; and in {rest} more" if rest else ""
    return f"The difference is surest {'; '.join(first)}{more}."


def held_out_sentence(held: "Dataset | None") -> str:
    """Whether the explanations hold on recordings that nothing was fitted to.

    Args:
        held: The group `held_out`; None if there is none.
    """
    if held is None:
        return (
            "Nothing was tried on recordings held out: give some with --held-out to see whether an"
            " explanation holds elsewhere."
        )
    parts = []
    for name in held["explanation"].to_numpy():
        holds = bool(held["holds"].sel(explanation=name))
        parts.append(f"{words(str(name))} {'holds' if holds else 'does not hold'}")
    sentence = "; ".join(parts)
    return f"On the recordings held out, {sentence}."


def seen_sentence(effects: "Dataset") -> str:
    """What these data could show at its typical size, most visible first."""
    snr = effects["snr"].to_numpy()
    order = [i for i in np.argsort(-np.nan_to_num(snr)) if snr[i] >= SEEN]
    names = [f"{words(str(effects['effect'].to_numpy()[i]))} ({snr[i]:.0f})" for i in order]
    return f"could be seen (signal-to-noise ratio): {', '.join(names) or 'none of the effects'}"


def unseen_sentence(effects: "Dataset") -> str:
    """Which effects could act without being seen; empty if there are none.

    Args:
        effects: The group of that name.
    """
    low = effects["snr"].to_numpy() < SEEN
    names = [str(name) for name in effects["effect"].to_numpy()[low]]
    if not names:
        return ""
    return (
        f"At its typical size, {listed(names, 'or')} has a signal-to-noise ratio below {SEEN:.0f}"
        " in these data: it could act without being seen."
    )


def untested_sentence(section: Mapping[str, Any]) -> str:
    """Which effects were not tested to the end; empty if all were."""
    if not section["untested"]:
        return ""
    return (
        f"Untested: {listed(section['untested'])}. Its simulations failed, or others came first"
        " when the best were simulated where they fit best."
    )


def suggestion_sentence(section: Mapping[str, Any]) -> str:
    """Which experiment to make next."""
    suggestions = section["suggestions"]
    if not suggestions:
        return "No two explanations remain that a further experiment would have to tell apart."
    best = max(suggestions, key=lambda one: one["snr"])
    between = " from ".join(words(name) for name in best["between"])
    ratio = f"a signal-to-noise ratio of {best['snr']:.1f}"
    if best["snr"] < SEEN:
        return (
            f"None of the experiments considered would tell {between}: the best of them,"
            f" {best['experiment']}, is expected to have {ratio}."
        )
    return f"To tell {between}, record {best['experiment']}: {ratio} is expected."


def noise_sentence(section: Mapping[str, Any]) -> str:
    """How the cameras' noise was learned."""
    noise = section["noise"]
    return (
        f"The cameras' noise was learned from {noise['samples']} samples at rest before the"
        f" gripper moved: {noise['sd_deg']:.2f}° (sd), known to"
        f" {100.0 * noise['sd_uncertainty']:.0f} %, with a correlation of"
        f" {noise['correlation']:.2f} from one sample to the next."
    )


def pours_sentence(pours: Mapping[str, Any]) -> str:
    """The verdict on the pours alone, and how far they are from what was expected.

    Args:
        pours: The entry of that name in "criticise".
    """
    points = f"{100.0 * pours['before']:.1f} percentage points RMS"
    if pours["after"] is not None:
        points += f", and {100.0 * pours['after']:.1f} with what explains them"
    verdict = verdict_sentence(pours).replace("Simulation and data", "Simulated and real pours")
    return f"{verdict} Spilled and retained fractions differ by {points}."


def best_gains(effects: "Dataset", count: int = NAMED) -> list[str]:
    """The effects that alone explain most, best first."""
    gains = effects["gain"].to_numpy()
    order = [i for i in np.argsort(-np.nan_to_num(gains, nan=-np.inf)) if gains[i] > 0.0]
    return [
        f"{words(str(effects['effect'].to_numpy()[i]))} (gain {gains[i]:.1f},"
        f" p = {effects['p_value'].to_numpy()[i]:.2g})"
        for i in order[:count]
    ]
