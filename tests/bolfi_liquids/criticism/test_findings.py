"""What stirs and pours found, together."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.criticism import Gap, Sensitivity

from bolfi_liquids.criticism import criticism_file
from bolfi_liquids.criticism.criticism_file import (
    _effects,
    _posterior,
    _residual,
    best_of,
    criticism_tree,
)
from bolfi_liquids.criticism.summary import GapSummary, unsupported
from bolfi_liquids.inputs.settings import CriticismSettings


def model(names, value):
    """Of liquid and effects, all of whose parameters are believed to be `value`."""
    parameters = ["viscosity", "cohesion", *names]
    draws = {name: (("chain", "draw"), np.full((2, 3), value)) for name in parameters}
    posterior = xr.DataTree(xr.Dataset(draws))
    fit = SimpleNamespace(
        prior=SimpleNamespace(names=parameters),
        sample=lambda *_, **__: {"posterior": posterior},
    )
    return SimpleNamespace(names=names, fit=fit, best=dict.fromkeys(parameters, value))


def found_in(stirs, pours=None):
    return {"stirs": stirs} if pours is None else {"stirs": stirs, "pours": pours}


def source(accepted, extended):
    base = SimpleNamespace(hypothesis=model((), 0.0), signatures=())
    concluded = {"accepted": accepted, "extended": extended, "base": base}
    shown = {"gaps": {}, "suggestions": (), "probabilities": {}, "confusion": np.zeros((0, 0))}
    return SimpleNamespace(**concluded, **shown)


@pytest.fixture
def attributes(monkeypatch):
    """(stirs, pours, accept) -> attributes of criticism.nc, whose tables stay empty."""
    for table in ("_residual", "_where", "_effects"):
        monkeypatch.setattr(criticism_file, table, lambda *_: xr.Dataset())

    def attributes(stirs, pours, accept=None):
        settings = CriticismSettings(accept=accept)
        stirring = SimpleNamespace(time=np.zeros(1), member=np.zeros(1, int))
        inputs = SimpleNamespace(settings=settings, density=1000.0, stirring=stirring, table=None)
        return criticism_tree(inputs, found_in(stirs, pours)).attrs

    return attributes


DELAY = source(("camera_delay",), model(("camera_delay",), 1.0))
THINNING = source(("shear_thinning",), model(("shear_thinning",), 1.0))
NOTHING = source((), None)


@pytest.mark.parametrize(
    ("stirs", "pours", "expected"),
    [
        (NOTHING, None, {"viscosity": 0.0, "cohesion": 0.0}),
        (DELAY, NOTHING, {"viscosity": 1.0, "cohesion": 1.0, "camera_delay": 1.0}),
        (
            DELAY,
            source(("adhesion",), model(("adhesion",), 2.0)),
            {"viscosity": 2.0, "cohesion": 2.0, "adhesion": 2.0, "camera_delay": 1.0},
        ),
        (
            THINNING,
            source(("adhesion",), model(("shear_thinning", "adhesion"), 2.0)),
            {"viscosity": 2.0, "cohesion": 2.0, "shear_thinning": 2.0, "adhesion": 2.0},
        ),
    ],
    ids=["nothing", "pours agree", "a sensor's", "a liquid's"],
)
def test_the_last_model_says_what_it_knows_and_the_stirs_the_rest(
    attributes, stirs, pours, expected
):
    together = found_in(stirs, pours)
    assert best_of(together) == expected
    posterior = _posterior(together, 0)
    assert {name: float(values.mean()) for name, values in posterior.items()} == expected
    assert set(attributes(stirs, pours)["accepted"]) <= set(expected)


def test_what_was_requested_is_told_from_what_was_found(attributes):
    pours = source(("adhesion",), model(("adhesion",), 2.0))
    assert attributes(DELAY, pours, accept=("adhesion",))["requested"] == ["adhesion"]
    assert attributes(DELAY, pours)["requested"] == []
    stirs = source(("camera_delay",), model(("camera_delay",), 1.0))
    for explains, expected in ((True, ()), (False, ("camera_delay",))):
        stirs.leading = SimpleNamespace(accepted=explains)
        assert unsupported({"stirs": stirs}) == expected


def candidate(name, **changes):
    """Of an effect that explains the difference, but for `changes`."""
    check = SimpleNamespace(p_value=0.5)
    hypothesis = SimpleNamespace(best={name: 1.0})
    made = {"names": (name,), "gain": 9.0, "passes": True, "refitted": True}
    return SimpleNamespace(**{**made, **changes}, check=check, hypothesis=hypothesis)


def test_each_effect_has_one_row_that_says_what_became_of_it():
    singles = {
        "stick_mass": candidate("stick_mass"),
        "camera_delay": candidate("camera_delay"),
        "fill_level": candidate("fill_level", passes=False),
        "pivot_friction": candidate("pivot_friction", passes=False, gain=1.0),
        "gripper_scale": candidate("gripper_scale", refitted=False),
        "camera_tilt": candidate("camera_tilt"),
    }
    names = (*singles, "adhesion")
    signature = SimpleNamespace(coefficient=1.0, snr=2.0, side=0)
    base = SimpleNamespace(
        signatures=dict.fromkeys(names[:-1], signature), check=SimpleNamespace(scores={})
    )
    found = SimpleNamespace(
        base=base,
        singles=singles,
        units=dict.fromkeys(names, "1"),
        untested=("gripper_scale", "adhesion"),
        sensitivities=dict.fromkeys(names, Sensitivity(0.5, 1.5)),
        refuted=(("camera_delay",),),
        verdict=SimpleNamespace(kind="effect", effects=("stick_mass",)),
    )
    table = _effects(found)
    assert dict(zip(table["effect"].to_numpy(), table["status"].to_numpy(), strict=True)) == {
        "stick_mass": "named",
        "camera_delay": "refuted by held-out data",
        "fill_level": "rejected: the data still differ",
        "pivot_friction": "rejected: explains nothing",
        "gripper_scale": "untested by a refit",
        "camera_tilt": "less likely",
        "adhesion": "untested: its simulations failed",
    }
    assert table.sizes["effect"] == len(names)


def hypothesis(difference):
    """Of four data, of which it leaves the difference [rad]."""
    output = SimpleNamespace(restore=lambda rows: rows.reshape(-1, 2, 2))
    return SimpleNamespace(
        difference=np.array(difference),
        own=3.0 * np.eye(4),
        spread=5.0 * np.eye(4),
        noise=4.0 * np.eye(4),
        surrogate=SimpleNamespace(output=output),
        names=("camera_delay",),
    )


def test_gaps_and_residuals_are_observed_less_expected():
    before, after = hypothesis([5.0, -5.0, 5.0, -5.0]), hypothesis([3.0, -3.0, 3.0, -3.0])
    sizes = {"before": 10.0, "after": 6.0, "noise": 3.0, "model_error": 4.0, "floor": 0.0}
    gap = Gap("third", **sizes, p_before=0.0, p_value=1.0, lpd_gain=0.0)
    found = SimpleNamespace(
        leading=SimpleNamespace(hypothesis=after, names=after.names),
        base=SimpleNamespace(hypothesis=before),
        extended=after,
        gaps={after.names: (gap, gap)},
        experiment=SimpleNamespace(
            measurement=SimpleNamespace(covariance=lambda layout: 6.0 * np.eye(4)),
            model_error_rms=4.0,
            observed=np.zeros((2, 2)),
        ),
    )
    summary = {name: np.radians(of) for name, of in vars(GapSummary.of(found)).items()}
    expected = {"noise": 3.0, "usual": 4.0, "rms_before": 5.0, "rms_after": 3.0}
    expected |= {"before": 0.0, "after": 0.0}
    expected |= {"held_out_noise": 3.0, "held_out_usual": 4.0}
    expected |= {"held_out_rms_before": 10.0, "held_out_rms_after": 6.0}
    expected |= {"held_out_before": np.sqrt(75.0), "held_out_after": np.sqrt(11.0)}
    assert summary == pytest.approx(expected, abs=1e-9)
    residual = _residual(found, ("frame", "plane"), {"units": "rad"})
    assert residual["expected_after"].to_numpy().tolist() == [[-3.0, 3.0], [-3.0, 3.0]]
    assert (residual["sd_before"] == 3.0).all() and residual["observed"].attrs["units"] == "rad"
