"""What a report warns of."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.criticism.verdict_kind import VerdictKind

from bolfi_liquids.calibration.fit_figures import _rms_by
from bolfi_liquids.calibration.summary import CalibrationSummary, FitStatus
from bolfi_liquids.criticism.source_summary import PourVerdict
from bolfi_liquids.criticism.summary import CriticismSummary
from bolfi_liquids.pouring.draining import Hold
from bolfi_liquids.pouring.figures import not_surely_worse
from bolfi_liquids.pouring.result import ActionSummary, GivenPour, GivenSummary, PourSummary
from bolfi_liquids.reporting.warnings import warnings_of

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


def poured(rate=1.0, distance=0.03, retained=0.05):
    actions = xr.Dataset(
        coords={"angular_velocity": [0.5, 1.0, 3.0], "distance": [0.0, 0.03, 0.07]}
    )
    chosen = xr.Dataset(
        {"retained": ("outcome", [0.0, 2.0 * retained])},
        attrs={"angular_velocity": rate, "distance": distance},
    )
    tree = xr.DataTree.from_dict({"/actions": actions, "/chosen": chosen})
    tree.attrs.update(cups='{"pour": {"hold": 0.9}}')
    return tree


@dataclass(frozen=True)
class Parts:
    """All that warnings follow from."""

    calibrated: CalibrationSummary
    latest: CalibrationSummary
    criticised: CriticismSummary | None
    poured: PourSummary | None
    pour: xr.DataTree | None
    searched: int
    outdated: tuple[str, ...] = ()


def warned(parts):
    """The warnings of a run that holds these parts."""
    initial = parts.calibrated.n_simulations - parts.searched
    found = SimpleNamespace(
        calibration=SimpleNamespace(
            summary=parts.calibrated, tree=SimpleNamespace(attrs={"initial": initial})
        ),
        latest=SimpleNamespace(summary=parts.latest),
        criticism=parts.criticised and SimpleNamespace(summary=parts.criticised),
        pour=parts.poured and SimpleNamespace(summary=parts.poured, tree=parts.pour),
        outdated=parts.outdated,
        remedies=("bolfi-liquids pour RUN",) * len(parts.outdated),
    )
    return warnings_of(found)


@pytest.fixture
def fine(calibration, criticism_summary):
    """Results without anything to warn of."""
    return Parts(
        calibrated=replace(calibration.summary, **FINE),
        latest=replace(calibration.summary, **FINE),
        criticised=replace(criticism_summary, **AGREES),
        poured=POURED,
        pour=poured(),
        searched=13,
    )


def test_nothing_is_said_where_nothing_is_wrong(fine):
    assert warned(fine) == []


@pytest.mark.parametrize(
    ("field", "changes", "key", "values"),
    [
        ("latest", {"rhat_max": 1.2}, "calibration.not_converged", {}),
        (
            "latest",
            {"below_least_viscosity": 0.5, "least_viscosity": 0.03},
            "calibration.least_viscosity",
            {"least": 0.03, "share": 0.5},
        ),
        (
            "calibrated",
            {"emulator_warnings": ("too few runs",)},
            "calibration.surrogate_in_doubt",
            {"text": "too few runs"},
        ),
        ("criticised", None, "warning.not_criticised", {}),
        ("criticised", {"baseline": 0}, "criticism.no_baseline", {}),
        (
            "criticised",
            {"frame_faults": ("other.nc: turned",)},
            "warning.compared_in_a_wrong_frame",
            {"faults": ("other.nc: turned",)},
        ),
        ("criticised", {"verdict": VerdictKind.UNKNOWN}, "criticism.unexplained", {}),
        ("criticised", UNCONFIRMED, "criticism.effect_unconfirmed", {"effects": ("stick_mass",)}),
        ("poured", {"expected_spillage": 0.12}, "warning.much_spilled", {"share": 0.12}),
    ],
)
def test_each_warning_is_given_alone(fine, field, changes, key, values):
    changed = changes and replace(getattr(fine, field), **changes)
    (sentence,) = warned(replace(fine, **{field: changed}))
    assert sentence.key == key
    assert values.items() <= sentence.values.items()
    assert str(sentence)


@pytest.mark.parametrize(
    ("action", "key", "values"),
    [
        ({"rate": 0.5}, "at_the_edge", {"ends": ("slowest",)}),
        ({"rate": 3.0, "distance": 0.07}, "at_the_edge", {"ends": ("fastest", "farthest")}),
        (
            {"retained": 0.11},
            "much_retained",
            {"share": pytest.approx(0.11), "held": 0.9, "hold": None},
        ),
    ],
)
def test_each_warning_of_the_chosen_action(fine, action, key, values):
    (sentence,) = warned(replace(fine, pour=poured(**action)))
    assert (sentence.key, sentence.values) == (f"warning.{key}", values)


@pytest.mark.parametrize(
    ("hold", "said"),
    [
        (Hold(6.3, 10.0, 0.08), "Hold it for 6.3 s to leave a tenth: write"),
        (Hold(41.0, 10.0, 0.25), "Hold it for 41 s to leave a tenth (extrapolated from 10 s)"),
        (Hold(np.nan, 10.0, 0.31), "Held for 10 s it still keeps 31 %"),
    ],
)
def test_the_hold_that_leaves_a_tenth_is_said(fine, hold, said):
    much = replace(fine, poured=replace(fine.poured, hold=hold), pour=poured(retained=0.54))
    (sentence,) = warned(much)
    assert said in str(sentence) and "54 %" in str(sentence) and "0.9 s" in str(sentence)


def test_a_pour_that_contradicts_the_simulator_is_said(fine):
    row = GivenPour(2, 30.0, 1.2, 0.127, 0.02, 0.001, 0.02)
    given = GivenSummary("oil.csv", "0", "", (2,), (row,), row, ACTION)
    (sentence,) = warned(replace(fine, poured=replace(fine.poured, given=given)))
    assert sentence.key == "warning.given_contradict"
    assert "line 2" in str(sentence) and "13 %" in str(sentence)


def test_what_does_not_count_any_more_is_said_with_its_remedy(fine):
    (sentence,) = warned(replace(fine, outdated=("pour.nc was made from another posterior",)))
    assert sentence.key == "warning.outdated"
    assert "pour.nc" in str(sentence) and "bolfi-liquids pour RUN" in str(sentence)


def test_an_end_of_the_range_is_no_loss_where_nothing_is_spilled(fine):
    nothing = replace(fine.poured, spillage_q95=0.0)
    assert not warned(replace(fine, pour=poured(rate=0.5), poured=nothing))


def test_a_misfit_that_was_not_criticised_is_told(fine):
    far = replace(fine.calibrated, fit_rms_deg=0.9)
    (sentence,) = warned(replace(fine, calibrated=far, criticised=None))
    assert sentence.key == "warning.misfit_not_criticised"


def test_pours_that_nothing_explains_are_told_beside_an_effect_of_the_stirs(fine):
    unexplained = PourVerdict(VerdictKind.UNKNOWN, (), 0.003, (), 0, before=0.4, after=None)
    found = replace(fine.criticised, held_out=1, pours=unexplained, **CONFIRMED)
    (sentence,) = warned(replace(fine, criticised=found))
    assert sentence.key == "criticism.unexplained" and sentence.values["data"] == "pours"


def test_an_effect_that_held_out_data_confirm_is_nothing_to_warn_of(fine):
    confirmed = replace(fine.criticised, held_out=1, **CONFIRMED)
    assert warned(replace(fine, criticised=confirmed)) == []


def test_a_bad_fit_is_told_first(fine):
    """Of the calibration that is poured: an effect that was accepted may have mended it."""
    far = replace(fine.calibrated, fit_rms_deg=0.902)
    first, *_ = warned(replace(fine, calibrated=far, latest=far, criticised=None))
    assert (first.key, first.values) == ("calibration.bad_fit", {"summary": far})
    assert "3.0 times" in str(first)
    mended = replace(fine, calibrated=far)
    assert "calibration.bad_fit" not in [one.key for one in warned(mended)]


def test_a_search_of_no_more_than_its_start_is_none(fine):
    (sentence,) = warned(replace(fine, searched=1))
    assert sentence.key == "warning.no_search"
    assert sentence.values == {"total": 20, "searched": 1}


def test_a_run_without_a_pour_has_nothing_to_worry_about_in_it(fine):
    assert warned(replace(fine, poured=None, pour=None)) == []


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
