"""What a report warns of."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.criticism.verdict_kind import VerdictKind

import bolfi_liquids as bl
from bolfi_liquids.calibration.figures import _rms_by
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
UNCONFIRMED = CONFIRMED | {"held_out": 0}
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
def calibrated(calibration):
    """A calibration with nothing to warn of, but for changes of its numbers."""
    tested = calibration.tree.copy()
    tested.attrs["stick_radius_cells"] = [0.9]

    def of(**changes):
        summary = replace(calibration.summary, **(FINE | changes))
        return replace(calibration, tree=tested, summary=summary)

    return of


@pytest.fixture
def warned(calibrated, criticism_summary, made):
    """The warnings of a run with nothing to warn of, but for what is given."""

    def of(calibration=None, pour=POURED, criticism=AGREES, searched=13, **outdated):
        base = calibrated() if calibration is None else calibration
        tree = base.tree.copy()
        tree.attrs["initial"] = base.summary.n_simulations - searched
        base = replace(base, tree=tree)
        found = None
        if criticism is not None:
            both = {"parameters": {**base.summary.parameters, **criticism_summary.coefficient}}
            summary = replace(criticism_summary, **(both | criticism))
            found = bl.Criticism(base, made(), summary)
        chosen = poured(pour) if isinstance(pour, PourSummary) else pour
        return warnings_of(Results(base, found, chosen, **outdated))

    return of


def test_nothing_is_said_where_nothing_is_wrong(warned):
    assert warned() == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rhat_max": 1.2}, ["1.200", "--draws"]),
        ({"below_least_viscosity": 0.5, "least_viscosity": 0.03}, ["0.03 Pa s", "50 %"]),
        ({"emulator_warnings": ("too few runs",)}, ["surrogate", "too few runs"]),
    ],
)
def test_each_warning_of_a_calibration_is_given_alone(warned, calibrated, changes, words):
    (warning,) = warned(calibrated(**changes))
    assert all(word in warning for word in words)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (None, ["not criticised"]),
        ({"baseline": 0}, ["--baseline"]),
        ({"frame_faults": ("other.nc: turned",)}, ["other.nc: turned", "criticise again"]),
        ({"verdict": VerdictKind.UNKNOWN}, ["differ", "0.002"]),
        (UNCONFIRMED, ["may be stick mass"]),
    ],
)
def test_each_warning_of_a_criticism_is_given_alone(warned, changes, words):
    (warning,) = warned(criticism=None if changes is None else AGREES | changes)
    assert all(word in warning for word in words)


def test_cells_that_were_compared_with_no_reference_are_told(warned, calibrated, calibration):
    """200 particles make cells of three radii of the stick."""
    (warning,) = warned(replace(calibrated(), tree=calibration.tree))
    assert "0.33 cells" in warning and "--particles" in warning


def test_much_that_is_spilled_is_told(warned):
    (warning,) = warned(pour=replace(POURED, expected_spillage=0.12))
    assert "12 %" in warning


@pytest.mark.parametrize(
    ("action", "words"),
    [
        ({"rate": 0.5}, ["the slowest that"]),
        ({"rate": 3.0, "distance": 0.07}, ["the fastest and the farthest"]),
    ],
)
def test_an_end_of_what_is_allowed_is_told(warned, action, words):
    (warning,) = warned(pour=poured(**action))
    assert all(word in warning for word in words)


@pytest.mark.parametrize(
    ("hold", "words"),
    [
        (None, ["longer hold"]),
        (Hold(6.3, 10.0, 0.08), ["for 6.3 s", "tenth: write"]),
        (Hold(41.0, 10.0, 0.25), ["for 41 s", "extrapolated from 10 s"]),
        (Hold(np.nan, 10.0, 0.31), ["for 10 s", "31 %"]),
    ],
)
def test_much_that_stays_is_told_with_the_hold_that_leaves_a_tenth(warned, hold, words):
    (warning,) = warned(pour=replace(POURED, expected_retained=0.54, hold=hold))
    assert all(word in warning for word in ("54 %", "0.9 s", *words))


def test_a_pour_that_contradicts_the_simulator_is_said(warned):
    row = GivenPour(2, 30.0, 1.2, 0.127, 0.02, 0.001, 0.02)
    given = GivenSummary("oil.csv", "0", "", (2,), (row,), row, ACTION)
    (warning,) = warned(pour=replace(POURED, given=given))
    assert all(word in warning for word in ("line 2", "30.0°/s", "1.20 cm", "13 %", "0.25 %"))


def test_what_does_not_count_any_more_is_said_with_its_remedy(warned):
    outdated = ("pour.nc is older; make it again: bolfi-liquids pour RUN",)
    (warning,) = warned(pour=None, outdated=outdated)
    assert "pour.nc is older" in warning and "bolfi-liquids pour RUN" in warning


def test_an_end_of_the_range_is_no_loss_where_nothing_is_spilled(warned):
    assert warned(pour=poured(replace(POURED, spillage_q95=0.0), rate=0.5)) == []


def test_a_misfit_that_was_not_criticised_is_told(warned, calibrated):
    (warning,) = warned(calibrated(fit_rms_deg=0.9), criticism=None)
    assert "more than noise" in warning


def test_pours_that_nothing_explains_are_told_beside_an_effect_of_the_stirs(warned):
    unexplained = PourVerdict(VerdictKind.UNKNOWN, (), 0.003, (), 0, before=0.4, after=None)
    (warning,) = warned(criticism=CONFIRMED | {"held_out": 1, "pours": unexplained})
    assert "pours differ" in warning and "0.003" in warning


def test_an_effect_that_held_out_data_confirm_is_nothing_to_warn_of(warned):
    assert warned(criticism=CONFIRMED | {"held_out": 1}) == []


def test_a_bad_fit_is_told_first(warned, calibrated):
    """Of the calibration that is poured: an effect that was accepted may have mended it."""
    far = calibrated(fit_rms_deg=1.2)
    first, *_ = warned(far, criticism=None)
    assert first == bad_fit(far.summary) and "times the noise" in first
    assert warned(far, criticism=CONFIRMED | {"held_out": 1}) == []


def test_a_search_of_no_more_than_its_start_is_none(warned):
    (warning,) = warned(searched=1)
    assert "1 of 20" in warning and "--budget" in warning


def test_a_run_without_a_pour_has_nothing_to_worry_about_in_it(warned):
    assert warned(pour=None) == []


def test_an_action_is_surely_worse_only_as_far_as_paired_draws_tell(rng):
    liquids = rng.uniform(0.0, 0.5, size=(16, 1, 1))  # what all actions spill of a liquid alike
    spilled = np.repeat(liquids, 3, axis=2)
    spilled[..., 1] += np.tile([[-0.02], [0.022]], (8, 1))  # more by 0.001 on average, se 0.005
    spilled[..., 2] += 0.1
    assert not_surely_worse(spilled, "mean", (0, 0)).tolist() == [[True, True, False]]


def test_what_is_compared_is_the_risk_that_was_minimised():
    spilled = np.zeros((20, 1, 2))
    spilled[:, 0, 0] = 0.02  # little of every liquid
    spilled[:4, 0, 1] = 0.1  # nothing of most, as much on average, and more of the worst tenth
    assert not_surely_worse(spilled, "mean", (0, 0)).tolist() == [[True, True]]
    assert not_surely_worse(spilled, "cvar", (0, 0)).tolist() == [[True, False]]


def test_few_draws_tell_nothing():
    assert not not_surely_worse(np.zeros((3, 1, 2)), "mean", (0, 0)).any()


def test_the_residual_of_a_stroke_is_its_own():
    numbers = np.repeat([0, 1, 4], 5)
    values = np.where(numbers == 1, 3.0, 0.0)
    values[2] = np.nan
    assert _rms_by(numbers, values).tolist() == [0.0, 3.0, 0.0]
    values[numbers == 4] = np.nan
    assert np.isnan(_rms_by(numbers, values)[2])
