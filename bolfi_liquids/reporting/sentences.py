"""What a run shows, in plain sentences."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

UNITS = {"viscosity": "Pa s"}
UNLEARNED = 0.6  # share of the prior's 90 % interval above which little was learned
RHAT_MAX, ESS_MIN = 1.01, 400.0  # Vehtari et al. 2021
DIVERGENT_MAX = 0.01  # share of the draws
AT_THE_END = 0.02  # quantile of the prior; an interval that reaches it is cut off there
HARDLY_MORE, AS_GOOD_AS_NOISE = 1.1, 1.5  # times the noise
WORTH_A_WORD = 0.01  # share of the posterior


def with_unit(name: str, value: float) -> str:
    """A parameter's value to three digits, with its unit."""
    return f"{value:.3g} {UNITS.get(name, '')}".strip()


def percent(fraction: float) -> str:
    """A fraction to two digits, whole percents above ten."""
    return f"{100.0 * fraction:.0f} %" if fraction >= 0.1 else f"{100.0 * fraction:.2g} %"


def parameter_sentence(name: str, values: Mapping[str, float], prior: NDArray) -> str:
    """Where a parameter probably lies, and whether the stirring told much about it.

    Args:
        name: Of the parameter.
        values: Its entry in summary.json.
        prior: Draws from its prior, shape (n,).
    """
    low, high = values["q05"], values["q95"]
    ranks = np.searchsorted(np.sort(prior), (low, high)) / len(prior)
    share = float(ranks[1] - ranks[0]) / 0.9
    verdict = (
        "the stirring says little about it"
        if share > UNLEARNED
        else f"the stirring left {percent(share)} of what the prior held possible"
    )
    if share <= UNLEARNED and (ranks[0] < AT_THE_END or ranks[1] > 1.0 - AT_THE_END):
        verdict += "; it lies at the prior's end, so the truth may be beyond"
    return (
        f"{name.capitalize()} is probably between {with_unit(name, low)} and"
        f" {with_unit(name, high)} (90 %), median {with_unit(name, values['q50'])}: {verdict}."
    )


def fit_sentence(section: Mapping[str, Any]) -> str:
    """How well the closest hypothesis follows, measured by the noise."""
    fit, noise = section["fit_rms_deg"], section["noise_deg"]
    if fit <= HARDLY_MORE * noise:
        verdict = "it follows as closely as can be expected"
    elif fit <= AS_GOOD_AS_NOISE * noise:
        verdict = f"{fit / noise:.1f} times as much is nearly as close as can be expected"
    else:
        verdict = (
            "either more simulations would find a closer one, or the simulator's model of liquid,"
            " stick or cameras lacks something"
        )
    return (
        f"The closest of {section['n_simulations']} simulated hypotheses differs from the"
        f" recording by {fit:.2f}° RMS. Noise alone (of the cameras, and between equal"
        f" simulations) would leave {noise:.2f}°: {verdict}."
    )


def sampler_sentence(section: Mapping[str, Any]) -> str:
    """A warning where the draws are not to be trusted; empty where they are."""
    rhat = float("nan") if section["rhat_max"] is None else section["rhat_max"]
    ess, divergent = section["ess_min"], section["divergences"] / section["n_draws"]
    if rhat <= RHAT_MAX and ess >= ESS_MIN and divergent <= DIVERGENT_MAX:
        return ""
    return (
        f"The sampler did not converge well (R-hat {rhat:.3f}, effective sample size {ess:.0f},"
        f" {percent(divergent)} of the draws divergent): calibrate again with more draws or"
        " --sampler emcee before relying on the intervals."
    )


def emulator_sentences(section: Mapping[str, Any]) -> list[str]:
    """What the surrogate's own checks complain of."""
    return [f"The surrogate is in doubt: {said}." for said in section.get("emulator_warnings", ())]


def floor_sentence(section: Mapping[str, Any]) -> str:
    """That thin liquids look alike, where the liquid may be one of them; else empty."""
    share = section["below_least_viscosity"]
    if share < WORTH_A_WORD:
        return ""
    return (
        f"Below about {with_unit('viscosity', section['least_viscosity'])} liquids look alike to"
        f" the simulator, at this size of its particles and speed of the stirring: {percent(share)}"
        " of the posterior lies there, and says no more than that the liquid may be as thin."
        " Under its own weight, deep liquid resists as if it were thicker still."
    )


def pour_sentence(section: Mapping[str, Any]) -> str:
    """What to do, and what it is expected to spill."""
    velocity, distance = _action(section)
    return (
        f"Turn the source at {velocity} with its lip {distance} from the receiver's axis: expected"
        f" to spill {percent(section['expected_spillage'])}, in 19 of 20 cases at most"
        f" {percent(section['spillage_q95'])}."
    )


def sure_sentence(section: Mapping[str, Any]) -> str:
    """What the best action at theta* alone would do instead."""
    plug_in = section["plug_in"]
    judged = (
        "That is over liquids and landings that had no part in the choice. The best action at θ*"
    )
    if all(plug_in[key] == section[key] for key in ("angular_velocity_deg_s", "distance_cm")):
        return f"{judged} alone is the same."
    return (
        f"{judged} alone ({', '.join(_action(plug_in))}) would"
        f" spill {percent(plug_in['expected_spillage'])} of the same liquids, in 19 of 20 cases"
        f" at most {percent(plug_in['spillage_q95'])}."
    )


LIMITS = (
    "All of this is the simulator's word. Another solver spilled up to two percentage points more"
    " by pours that were chosen like this."
)
"""`reproduce recordings`: water, oil and glycerin, N = 10 and 20."""


def _action(section: Mapping[str, Any]) -> tuple[str, str]:
    """Angular velocity and distance, as they are told."""
    velocity, distance = section["angular_velocity_deg_s"], section["distance_cm"]
    return f"{velocity:.0f}°/s", f"{distance:.1f} cm"
