"""Facts of a run as page and terminal show them: each number is rounded once, here, to a text.

A chapter is a dictionary: `calibration`, `criticism` and `pour` of what each command found,
`latest` of the posterior that is poured. Conditions under which something is said are facts, too.
"""

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from ..calibration.result import Calibration
from ..calibration.summary import CalibrationSummary, ParameterSummary, SamplerStatus, bad_fit
from ..calibration.until import parts_of
from ..criticism.result import Criticism
from ..criticism.summary import CriticismSummary, DifferingWindow, PourVerdict, SourceVerdict
from ..inference.criticism.verdict_kind import CERTAIN, MAX_STATED, VerdictKind
from ..models.numerics import is_tested
from ..pouring.pours import TENTH, Hold
from ..pouring.result import ActionSummary, GivenPour, GivenSummary, Pour
from ..wording import (
    LEAST_SPILLED,
    LIQUID_UNITS,
    at_most,
    degrees,
    percent,
    spilled,
    spoken,
    unit_of,
    with_unit,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from xarray import DataTree

Facts = dict[str, Any]

UNLEARNED_SHARE = 0.6
"""Share of the prior's 90 % interval above which little was learned."""

PRIOR_END = 0.02
"""Quantile of the prior; an interval that reaches it is cut off there."""

FIT_AT_NOISE, FIT_NEAR_NOISE = 1.1, 1.5
"""Times the noise up to which a fit is as close, or nearly as close, as can be expected."""

MIN_ALIKE_SHARE = 0.01
"""Share of the posterior below which thin liquids are not mentioned."""

MIN_SEARCHED = 3
"""Simulations that the engine chose, of which fewer are no search."""

DETECTABLE_SNR = 3.0
"""Signal-to-noise ratio from which a difference can be relied upon."""

MAX_LISTED = 3
"""Windows, or effects, that a sentence lists."""

MUCH_SPILLED = 0.05
"""Expected spillage that a person would mop up."""

ACTION_ENDS = {"angular_velocity": ("slowest", "fastest"), "distance": ("nearest", "farthest")}
"""What an action at either end of the range of each quantity is called."""

HELD_OUT_ANGLES = ("before", "after", "noise", "floor")
"""RMS of what is compared on a held-out recording."""

NONE = "–"
"""In a table, where there is no number."""


def calibration_facts(calibration: Calibration) -> Facts:
    """Facts of the search, the posterior and the fit.

    Args:
        calibration: Without what a criticism accepted.
    """
    summary, tree = calibration.summary, calibration.tree
    prior, initial = tree["prior"], int(tree.attrs["initial"])
    searched = summary.n_simulations - initial
    return {
        **fit_facts(summary),
        "version": summary.version,
        "parameters": [
            {
                **_parameter(name, values),
                **_learned(values, prior[name].to_numpy().ravel()),
                "best": f"{summary.best[name]:.3g}",
                "closest": f"{summary.closest[name]:.3g}",
            }
            for name, values in summary.parameters.items()
        ],
        "simulations": summary.n_simulations,
        "start": min(initial, summary.n_simulations),
        "searched": searched,
        "few_searched": searched < MIN_SEARCHED,
        "checks": summary.n_check_simulations,
        "confirming": tree["simulations"].sizes["simulation"] - summary.n_simulations,
        "confirmed": summary.confirmed,
        "until": _until(calibration),
        "seconds": {name: f"{spent:.0f}" for name, spent in vars(summary.seconds).items()},
        "doubts": summary.emulator_warnings,
        "untested": _untested_cells(calibration),
    }


def _until(calibration: Calibration) -> Facts | None:
    """What was known when the search ended; None where it had no goal."""
    settings, error = calibration.record["settings"], calibration.summary.until_error
    if error is None:
        return None
    quantity, tolerance = parts_of(settings["until"])
    pour = quantity == "spillage"
    known = f"{100 * error:.2g}" if pour else f"{error:.2g}"
    return {
        **{"text": settings["until"], "most": settings["budget"], "pour": pour, "known": known},
        "early": calibration.summary.n_simulations < settings["budget"],
        "reached": error <= tolerance,
    }


def _untested_cells(calibration: Calibration) -> str | None:
    """The stick's radius in cells, where it is none that was compared with references."""
    ratios = np.atleast_1d(calibration.tree.attrs.get("stick_radius_cells", [])).tolist()
    return next((f"{ratio:.2f}" for ratio in ratios if not is_tested(ratio)), None)


def fit_facts(summary: CalibrationSummary) -> Facts:
    """Facts of the fit and the sampler, whichever effects were added."""
    alike = summary.below_least_viscosity
    ratio = summary.fit_rms_deg / summary.noise_deg
    near = summary.unexplained_deg <= FIT_NEAR_NOISE * summary.noise_deg
    if ratio <= FIT_AT_NOISE:
        fit = "at noise"
    elif ratio <= FIT_NEAR_NOISE:
        fit = "near noise"
    else:
        fit = "within error" if near else "above noise"
    return {
        "intervals": {
            spoken(name): values.interval(name) for name, values in summary.parameters.items()
        },
        "bad": bad_fit(summary),
        "fit": fit,
        "misfit": not near,
        "rms": degrees(summary.fit_rms_deg),
        "noise": degrees(summary.noise_deg),
        "times_noise": f"{ratio:.1f}",
        "error": degrees(summary.simulator_error_deg),
        "model_error": degrees(summary.model_error_deg) if summary.model_error_deg else "",
        "clean": summary.clean,
        "converged": summary.sampler_status is SamplerStatus.CONVERGED,
        "rhat": f"{summary.rhat_max:.3f}",
        "ess": f"{summary.ess_min:.0f}",
        "divergent": percent(summary.divergent_share),
        "least": with_unit("viscosity", summary.least_viscosity),
        "alike": percent(alike) if alike >= MIN_ALIKE_SHARE else "",
    }


def _parameter(name: str, values: ParameterSummary) -> Facts:
    """A posterior's interval in its unit, and its numbers for a table."""
    numbers = {key: f"{value:.3g}" for key, value in vars(values).items()}
    low, median, high = (with_unit(name, at) for at in (values.q05, values.q50, values.q95))
    shown = {"low": low, "median": median, "high": high}
    return {"name": spoken(name), "unit": LIQUID_UNITS.get(name, ""), **numbers, **shown}


def _learned(values: ParameterSummary, prior: "NDArray[np.float64]") -> Facts:
    """Facts of a posterior beside draws (n,) from its prior."""
    low, high = np.searchsorted(np.sort(prior), (values.q05, values.q95)) / len(prior)
    share = float(high - low) / 0.9
    return {
        "share": percent(share),
        "learned": share <= UNLEARNED_SHARE,
        "at_end": bool(low < PRIOR_END or high > 1.0 - PRIOR_END),
    }


def criticism_facts(criticism: Criticism) -> Facts:
    """Facts of a criticism: verdicts, accepted effects, and the rows of its tables."""
    summary, sources = criticism.summary, dict(criticism.tree.children)
    del sources["posterior"]
    effects, held = _rows(sources["stirs"], "effects"), _held_out(sources["stirs"])
    snr = {one["effect"]: one["snr"] for one in effects if np.isfinite(one["snr"])}
    ranked = sorted(snr.items(), key=lambda item: -item[1])
    where = [_place(window) for window in summary.where[:MAX_LISTED]]
    gains = sorted((one for one in effects if one["gain"] > 0.0), key=lambda one: -one["gain"])
    return {
        **vars(summary),
        **verdict_facts(summary),
        "considered": summary.considered,
        "coefficients": [_coefficient(*item) for item in summary.coefficient.items()],
        "refit": [
            {
                "name": name,
                "now": summary.parameters[name].interval(name),
                "before": was.interval(name),
            }
            for name, was in criticism.base.summary.parameters.items()
            if summary.accepted
        ],
        "gap": {
            name: "" if angle is None else degrees(angle)
            for name, angle in vars(summary.gap).items()
        },
        "usual": bool(summary.gap.usual),
        "where": where,
        "more_where": len(summary.where) - len(where),
        "detectable": {
            spoken(name): f"{ratio:.0f}" for name, ratio in ranked if ratio >= DETECTABLE_SNR
        },
        "undetectable": [name for name, ratio in snr.items() if ratio < DETECTABLE_SNR],
        "detectable_from": f"{DETECTABLE_SNR:.0f}",
        "gains": [
            {
                "name": spoken(one["effect"]),
                "gain": f"{one['gain']:.1f}",
                "p": f"{one['p_value']:.2g}",
            }
            for one in gains[:MAX_LISTED]
        ],
        "holds": {one["explanation"]: one["holds"] for one in held},
        "held_out": held,
        "effects": {name: _effects(source) for name, source in sources.items()},
        "suggestions": [
            vars(one)
            | {"snr": f"{one.snr:.1f}", "helps": one.snr >= DETECTABLE_SNR}
            | {"before": percent(one.wrong_before), "after": percent(one.wrong_after)}
            | {
                "cost": f"{one.cost_s:.0f} s",
                "file": one.motion and one.motion == summary.next_motion,
            }
            for one in summary.suggestions
        ],
        "noise": {
            "sd": degrees(summary.noise.sd_deg),
            "uncertainty": percent(summary.noise.sd_uncertainty),
            "correlation": f"{summary.noise.correlation:.2f}",
            "samples": summary.noise.samples,
        },
        "seconds": f"{summary.seconds:.0f}",
    }


def verdict_facts(summary: CriticismSummary) -> Facts:
    """The verdicts on all data, on stirs and on pours, and those that are a reason to doubt."""
    pours = summary.pours
    everything, stirs = _verdict("all", summary), _verdict("stirs", summary.stirs)
    poured = None if pours is None else _verdict("pours", pours)
    if poured is None:  # these are all data
        everything["limits"] = stirs["limits"]
    # an effect can take up any error that looks like it, also the simulator's own
    confirmed = summary.accepted and summary.held_out
    settled = summary.verdict is VerdictKind.AGREEMENT or confirmed
    unsettled = [] if settled else [everything]
    # what one source named explains nothing of the other
    if summary.verdict is not VerdictKind.UNKNOWN:
        parts = [part for part in (stirs, poured) if part is not None]
        unsettled += [part for part in parts if part["verdict"] == VerdictKind.UNKNOWN]
    return {"all": everything, "stirs": stirs, "pours": poured, "unsettled": unsettled}


def _verdict(data: str, found: CriticismSummary | SourceVerdict) -> Facts:
    """A conclusion on "all", "stirs" or "pours"."""
    limits = found.limits if isinstance(found, SourceVerdict) else {}
    stated = found.probability
    facts = {
        "data": data,
        "verdict": str(found.verdict),
        "p": f"{found.p_value:.2g}",
        "probability": percent(stated) if stated < MAX_STATED else "over 99 %",
        "effects": _spoken(found.effects),
        "perhaps": [f"{spoken(name)} ({percent(p)})" for name, p in found.perhaps.items()],
        "confirmed": found.held_out > 0,
        "certain": found.held_out > 0 and found.probability >= CERTAIN,
        "refuted": _spoken(found.refuted),
        "limits": [f"{spoken(name)} {with_unit(name, at)}" for name, at in limits.items()],
    }
    if isinstance(found, PourVerdict):
        rms = {"before": found.before, "after": found.after}
        facts |= {when: None if at is None else f"{100 * at:.1f}" for when, at in rms.items()}
    return facts


def _coefficient(name: str, values: ParameterSummary) -> Facts:
    """Facts of an accepted effect: its size and meaning."""
    from ..models import EFFECTS

    text = EFFECTS[name].text if name in EFFECTS else ""
    return {"text": text, "neutral": _neutral(name), **_parameter(name, values)}


def _neutral(name: str) -> str:
    """Coefficient without effect; "" of a user's own that this process has not registered."""
    from ..models import EFFECTS

    return with_unit(name, EFFECTS[name].neutral) if name in EFFECTS else ""


def _place(window: DifferingWindow) -> Facts:
    """A window in which model and data differ."""
    ends = (window.start_s, window.stop_s)
    start, stop = (NONE if end is None else f"{end:.1f}" for end in ends)
    numbers = {"rms": degrees(window.rms_deg), "p": f"{window.p_value:.2g}"}
    return {**vars(window), **numbers, "start": start, "stop": stop}


def _rows(source: "DataTree", group: str) -> list[dict[str, Any]]:
    """Rows of a table, by the names of its columns; none where there is no such table."""
    if group not in source.children:
        return []
    table: Any = source[group].to_dataset().to_dataframe().reset_index()
    return table.to_dict("records")


def _held_out(source: "DataTree") -> list[Facts]:
    """Each explanation on each held-out recording."""
    return [
        {
            "explanation": spoken(one["explanation"]),
            "recording": one["recording"],
            **{key: degrees(np.degrees(one[key])) for key in HELD_OUT_ANGLES},
            "p": f"{one['p_value']:.2g}",
            "gain": f"{one['lpd_gain']:.1f}",
            "holds": bool(one["holds"]),
        }
        for one in _rows(source, "held_out")
    ]


def _effects(source: "DataTree") -> list[Facts]:
    return [
        {
            "name": spoken(one["effect"]),
            "neutral": _neutral(one["effect"]) or NONE,
            "typical": _number(one["typical"], ".3g", unit_of(one["effect"])),
            "smallest": _number(one["smallest"], ".2g", unit_of(one["effect"])),
            "limit": _number(one["limit"], ".2g", unit_of(one["effect"])),
            "snr": _number(one["snr"], ".1f"),
            "similar": _most_similar(one["effect"], source["confusion/cosine"]),
            "gain": _number(one["gain"], ".1f"),
            "p": _number(one["p_value"], ".2g"),
            "coefficient": _number(one["coefficient"], ".3g", unit_of(one["effect"])),
            "status": one["status"],
        }
        for one in _rows(source, "effects")
    ]


def _most_similar(name: str, cosine: Any) -> str:
    """The other effect whose signature is most like an effect's, with their cosine.

    Args:
        name: Of the effect.
        cosine: Between the signatures of all that were simulated, over (effect, other).
    """
    if name not in cosine["effect"] or cosine.sizes["other"] < 2:
        return NONE
    others = cosine.sel(effect=name).drop_sel(other=name)
    closest = others.isel(other=int(np.argmax(np.abs(others.to_numpy()))))
    return f"{spoken(str(closest['other'].item()))} ({closest.item():.2f})"


def pour_facts(pour: Pour) -> Facts:
    """Facts of the chosen pour, and of the best one for the most probable liquid alone."""
    summary, cups = pour.summary, json.loads(pour.tree.attrs["cups"])
    return {
        **_action(summary),
        "plug_in": _action(summary.plug_in),
        "same": summary.plug_in.action == summary.action,
        "risk": summary.risk,
        "simulations": summary.n_simulations,
        "map_error": percent(summary.map_error),
        "least": with_unit("viscosity", summary.least_viscosity),
        "contact_angle": f"{cups['source']['contact_angle_deg']:.3g}°",
        "given": summary.given and _given(summary.given, summary),
        "ends": _ends(pour.tree) if summary.spillage_q95 >= LEAST_SPILLED else [],
        "much_spilled": summary.expected_spillage > MUCH_SPILLED,
        "much_retained": summary.expected_retained > TENTH,
        "held": f"{cups['pour']['hold']:.2g}",
        "hold": summary.hold and _hold(summary.hold),
    }


def _action(action: ActionSummary) -> Facts:
    """An action and what becomes of the liquid."""
    shares = ("expected_received", "expected_retained")
    shares += ("received_q05", "received_q95", "retained_q05", "retained_q95")
    return {
        **_turn(action),
        "spilled": spilled(action.expected_spillage),
        "spilled_q95": at_most(action.spillage_q95),
        **{name.removeprefix("expected_"): percent(getattr(action, name)) for name in shares},
    }


def _turn(action: ActionSummary | GivenPour) -> Facts:
    turn, distance = action.angular_velocity_deg_s, action.distance_cm
    return {"turn": f"{turn:.1f}°/s", "distance": f"{distance:.2f} cm"}


def _given(given: GivenSummary, chosen: ActionSummary) -> Facts:
    """The pours that were made, those most like the chosen one, and what they have changed."""
    against = given.contradicting
    return {
        "file": given.file,
        "liquid": given.liquid,
        "count": len(given.lines),
        "nearest": [_made(one) for one in given.nearest],
        "contradicting": against and _made(against),
        "without": _action(given.without) if given.without.action != chosen.action else None,
    }


def _made(pour: GivenPour) -> Facts:
    """A pour that was made, beside what the map alone expects of it."""
    return {
        "line": pour.line,
        **_turn(pour),
        "spilled": percent(pour.spilled),
        "expected": spilled(pour.expected_spillage),
        "retained": percent(pour.retained),
        "expected_retained": percent(pour.expected_retained),
    }


def _hold(hold: Hold) -> Facts:
    """For how long the source must be held; "" where a minute is too short."""
    enough = hold.until_tenth_s
    return {
        "enough": f"{enough:.2g}" if np.isfinite(enough) else "",
        "extrapolated": enough > hold.simulated_s,
        "simulated": f"{hold.simulated_s:.2g}",
        "kept": percent(hold.retained_then),
    }


def _ends(pour: "DataTree") -> list[str]:
    """The ends of what was allowed at which the chosen pour is; a better one may lie beyond."""
    actions, chosen = pour["actions"], pour["chosen"].attrs
    return [
        end
        for name, ends in ACTION_ENDS.items()
        for end, limit in zip(ends, actions[name].to_numpy()[[0, -1]], strict=True)
        if np.isclose(chosen[name], limit)
    ]


def _spoken(names: Any) -> list[str]:
    return [spoken(name) for name in names]


def _number(value: float, form: str, unit: str = "") -> str:
    return f"{value:{form}} {unit}".strip() if np.isfinite(value) else NONE
