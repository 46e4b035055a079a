"""What a report warns of."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.criticism.verdict_kind import VerdictKind

import bolfi_liquids as bl
from bolfi_liquids.calibration.figures import rms_by
from bolfi_liquids.calibration.summary import FitStatus, bad_fit
from bolfi_liquids.criticism.summary import PourVerdict
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.pouring.figures import not_surely_worse
from bolfi_liquids.pouring.pours import Hold
from bolfi_liquids.pouring.result import (
    ActionSummary,
    GivenPour,
    GivenSummary,
    PourSummary,
)
from bolfi_liquids.pouring.spillage import Judged
from bolfi_liquids.reporting.warnings import Results, warnings_of

FINE = {
    "fit_rms_deg": 0.3,
    "noise_deg": 0.3,
    "below_least_viscosity": 0.0,
    "rhat_max": 1.0,
    "ess_min": 2000.0,
    "divergences": 0,
    "n_draws": 4000,
    "n_simulations": 20,
    "emulator_warnings": (),
}
AGREES = {"verdict": VerdictKind.AGREEMENT, "effects": (), "accepted": ()}
CONFIRMED = {"verdict": VerdictKind.EFFECT, "effects": ("stick_mass",), "accepted": ("stick_mass",)}
FATE = {"expected_received": 0.9, "received_q05": 0.85, "received_q95": 0.95}
FATE |= {"expected_retained": 0.05, "retained_q05": 0.0, "retained_q95": 0.1}
ACTION = ActionSummary(60.0, 3.0, 0.01, 0.05, **FATE)
POURED = PourSummary(
    **vars(ACTION),
    least_viscosity=0.01,
    n_simulations=99,
    risk="mean",
    seed=0,
    plug_in=ACTION,
    fit_status=FitStatus.ACCEPTABLE,
    map_error=0.01,
)


def poured(summary=POURED, rate=1.0, distance=0.03):
    """A chosen pour, among actions of 0.5 to 3 rad/s and 0 to 7 cm."""
    actions = xr.Dataset(
        coords={"angular_velocity": [0.5, 1.0, 3.0], "distance": [0.0, 0.03, 0.07]}
    )
    chosen = xr.Dataset(attrs={"angular_velocity": rate, "distance": distance})
    tree = xr.DataTree.from_dict({"/actions": actions, "/chosen": chosen})
    settings = bundled_cups().settings()
    settings["pour"]["hold"] = 0.9
    tree.attrs.update(cups=json.dumps(settings))
    judged = Judged(rate, distance, np.array([[0.01, 0.94, 0.05]]))
    return bl.Pour(None, judged, judged, tree, summary)


@pytest.fixture
def warned(calibration, criticism_summary, made):
    """The warnings of a run with nothing to warn of, but for what is given."""

    def of(calibrated=(), criticism=(), pour=(), searched=13, action=(), **outdated):
        summary = replace(calibration.summary, **(FINE | dict(calibrated)))
        tree = calibration.tree.copy()
        tree.attrs |= {"stick_radius_cells": [0.9], "initial": summary.n_simulations - searched}
        base, found, chosen = replace(calibration, tree=tree, summary=summary), None, None
        if criticism is not None:
            both = {"parameters": {**summary.parameters, **criticism_summary.coefficient}}
            found = replace(criticism_summary, **(both | AGREES | dict(criticism)))
            found = bl.Criticism(base, made(), found)
        if pour is not None:
            chosen = poured(replace(POURED, **dict(pour)), **dict(action))
        return warnings_of(Results(base, found, chosen, **outdated))

    return of


CONTRADICTION = GivenPour(2, 30.0, 1.2, 0.127, 0.02, 0.001, 0.02)
GIVEN = GivenSummary("oil.csv", "0", "", (2,), (CONTRADICTION,), CONTRADICTION, ACTION)
UNEXPLAINED = PourVerdict(
    VerdictKind.UNKNOWN, (), {}, 0.003, 0.9, {}, {}, (), 0, before=0.4, after=None
)
OLD = "pour.nc is older; make it again: bolfi-liquids pour RUN"


def hold(*numbers):
    return {"pour": {"expected_retained": 0.54, "hold": Hold(*numbers) if numbers else None}}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"calibrated": {"rhat_max": 1.2}}, ["1.200", "--draws"]),
        (
            {"calibrated": {"below_least_viscosity": 0.5, "least_viscosity": 0.03}},
            ["0.03 Pa s", "50 %"],
        ),
        ({"calibrated": {"emulator_warnings": ("too few runs",)}}, ["surrogate", "too few runs"]),
        ({"calibrated": {"fit_rms_deg": 0.9}, "criticism": None}, ["more than noise"]),
        ({"searched": 1}, ["1 of 20", "--budget"]),
        ({"pour": None, "outdated": (OLD,)}, ["pour.nc is older", "bolfi-liquids pour RUN"]),
        ({"criticism": None}, ["not criticised"]),
        ({"criticism": {"baseline": 0}}, ["--baseline"]),
        ({"criticism": {"frame_faults": ("other.nc: turned",)}}, ["other.nc: turned", "again"]),
        ({"criticism": {"verdict": VerdictKind.UNKNOWN}}, ["differ", "0.002"]),
        ({"criticism": CONFIRMED | {"held_out": 0}}, ["probably stick mass"]),
        ({"criticism": CONFIRMED | {"pours": UNEXPLAINED}}, ["pours differ", "0.003"]),
        ({"pour": {"expected_spillage": 0.12}}, ["12 %"]),
        ({"action": {"rate": 3.0, "distance": 0.07}}, ["the fastest and the farthest"]),
        (hold(), ["54 %", "0.9 s", "longer hold"]),
        (hold(6.3, 10.0, 0.08), ["for 6.3 s", "tenth: write"]),
        (hold(41.0, 10.0, 0.25), ["for 41 s", "extrapolated from 10 s"]),
        (hold(np.nan, 10.0, 0.31), ["for 10 s", "31 %"]),
        ({"pour": {"given": GIVEN}}, ["line 2", "30.0°/s", "1.20 cm", "13 %", "0.25 %"]),
    ],
)
def test_each_warning_is_given_alone(warned, given, words):
    (warning,) = warned(**given)
    assert all(word in warning for word in words)


def test_nothing_is_said_where_nothing_is_wrong(warned):
    assert warned() == warned(pour=None) == warned(criticism=CONFIRMED) == []
    # an end of the range is no loss where nothing is spilled
    assert warned(pour={"spillage_q95": 0.0}, action={"rate": 0.5}) == []


def test_cells_that_were_compared_with_no_reference_are_told(calibration):
    """200 particles make cells of three radii of the stick."""
    told = warnings_of(Results(calibration, None, None))
    assert any("0.33 cells" in one and "--particles" in one for one in told)


def test_a_bad_fit_is_told_first(warned, calibration):
    """Of the calibration that is poured: an effect that was accepted may have mended it."""
    far = FINE | {"fit_rms_deg": 1.2}
    first, *_ = warned(far, criticism=None)
    assert first == bad_fit(replace(calibration.summary, **far)) and "times the noise" in first
    assert warned(far, criticism=CONFIRMED) == []


def test_an_action_is_surely_worse_only_as_far_as_paired_draws_tell(rng):
    liquids = rng.uniform(0.0, 0.5, size=(16, 1, 1))  # what all actions spill of a liquid alike
    spilled = np.repeat(liquids, 3, axis=2)
    spilled[..., 1] += np.tile([[-0.02], [0.022]], (8, 1))  # more by 0.001 on average, se 0.005
    spilled[..., 2] += 0.1
    assert not_surely_worse(spilled, "mean", (0, 0)).tolist() == [[True, True, False]]
    assert not not_surely_worse(np.zeros((3, 1, 2)), "mean", (0, 0)).any()  # too few draws


def test_what_is_compared_is_the_risk_that_was_minimised():
    spilled = np.zeros((20, 1, 2))
    spilled[:, 0, 0] = 0.02  # little of every liquid
    spilled[:4, 0, 1] = 0.1  # nothing of most, as much on average, and more of the worst tenth
    assert not_surely_worse(spilled, "mean", (0, 0)).tolist() == [[True, True]]
    assert not_surely_worse(spilled, "cvar", (0, 0)).tolist() == [[True, False]]


def test_the_residual_of_a_stroke_is_its_own():
    numbers = np.repeat([0, 1, 4], 5)
    values = np.where(numbers == 1, 3.0, 0.0)
    values[2] = np.nan
    assert rms_by(numbers, values).tolist() == [0.0, 3.0, 0.0]
    values[numbers == 4] = np.nan
    assert np.isnan(rms_by(numbers, values)[2])
