"""A criticism as it is opened, and the calibration that it extends."""

import json
import pickle
import shutil
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.inference.criticism import Suggestion
from bolfi_liquids.inference.simulations import Compute
from bolfi_liquids.models.effects import OWN_EFFECTS

import bolfi_liquids as bl
from bolfi_liquids import models, next_stir
from bolfi_liquids.calibration.summary import bad_fit
from bolfi_liquids.criticism.result import calibration_to_pour
from bolfi_liquids.criticism.summary import SuggestedExperiment
from bolfi_liquids.drawing import new_figure
from bolfi_liquids.errors import InputError
from bolfi_liquids.motions import Motion
from bolfi_liquids.reporting.films import films_of
from bolfi_liquids.run.run import Run


@pytest.fixture
def run(calibration, tmp_path):
    return shutil.copytree(calibration.path, tmp_path / "run")


@pytest.fixture
def criticised(run, keep_criticism):
    """A copy of a run, with a criticism that accepted an effect."""
    return keep_criticism(run)


@pytest.fixture
def extended(criticised):
    return bl.Criticism.open(criticised).calibration


def test_the_motion_of_the_best_suggested_stir_is_kept_in_the_file(run, keep_criticism):
    """A pour may be better, and has no motion; a motion is back as `record` takes it."""
    motions = [
        Motion("star", points, 0.02, 0.1, 0.24, pause, 1) for points, pause in ((9, 0.0), (2, 0.4))
    ]
    made = [
        Suggestion(label, ("one", "other"), 5.0, error, 0.4, 8.0)
        for label, error in (("a pour", 0.01), (motions[1].label, 0.02), (motions[0].label, 0.1))
    ]
    suggestions = tuple(SuggestedExperiment.of(one, motions) for one in made)
    criticism = bl.Criticism.open(keep_criticism(run, suggestions=suggestions))
    assert criticism.summary.suggestions == suggestions
    assert Motion(**criticism.summary.next_motion) == motions[1]
    assert suggestions[0].motion is None and suggestions[1].wrong_before == 0.4


def latest_of(path):
    return calibration_to_pour(Run.open(path))


def test_an_accepted_effect_that_is_not_known_here_is_refused(criticised, monkeypatch):
    """Whatever simulates with it; the report without films only tells of it."""
    known = {name: one for name, one in models.EFFECTS.items() if name != "camera_delay"}
    monkeypatch.setattr(models, "EFFECTS", known)
    latest = bl.Criticism.open(criticised).calibration
    uses = (lambda: latest_of(criticised), lambda: films_of(latest, None, Compute(batch=1)))
    for use in uses:
        with pytest.raises(InputError, match="no effect camera_delay") as refused:
            use()
        assert str(criticised / "criticism.nc") in refused.value.where
        assert OWN_EFFECTS in refused.value.fix


def test_an_extended_calibration_shows_its_own_parameters(extended, calibration, criticised):
    criticism = bl.Criticism.open(criticised)
    assert extended.added == ("camera_delay",) and calibration.added == ()
    assert extended.summary.parameters == criticism.summary.parameters
    assert extended.best == criticism.summary.best
    assert "camera delay" in repr(extended) or "camera_delay" in repr(extended)
    assert (extended.summary.rhat_max, extended.summary.ess_min) == (1.002, 800.0)
    assert extended.summary.n_draws == extended.posterior["viscosity"].size
    assert set(extended.draws(4)) == {"viscosity", "cohesion", "camera_delay"}
    assert calibration.summary == bl.Calibration.open(criticised).summary  # left as it was


BAD = {"fit_rms_deg": 2.0, "noise_deg": 0.2}


@pytest.mark.slow
def test_an_effect_that_was_accepted_is_judged_by_the_fit_that_it_leaves(criticised, with_numbers):
    with_numbers(criticised, **BAD)
    assert bad_fit(bl.Calibration.open(criticised).summary) is not None
    assert bad_fit(calibration_to_pour(Run.open(criticised)).summary) is None
    gap = bl.Criticism.open(criticised).summary.to_json()["gap_deg"]
    for change in ({"rms_after": 2.0}, {"rms_after": None}):
        with_numbers(criticised, "criticise", gap_deg=gap | change)
        assert bad_fit(calibration_to_pour(Run.open(criticised)).summary) is not None


def test_an_effect_of_pours_alone_mends_no_stir(criticised, with_numbers):
    with_numbers(criticised, **BAD)
    stirs = bl.Criticism.open(criticised).summary.to_json()["stirs"]
    tied = stirs | {"verdict": "tie", "effects": ["stick_mass", "camera_tilt"]}
    with_numbers(criticised, "criticise", stirs=tied)
    assert bad_fit(calibration_to_pour(Run.open(criticised)).summary) is not None


def test_an_accepted_turn_of_the_cameras_mends_a_turned_frame(calibration):
    turned = replace(calibration.summary, frame_faults=("stir.nc: turned by 45 deg",))
    posterior = calibration.posterior
    rotation = {"camera_rotation": posterior["cohesion"]}
    assert turned.extended(posterior).frame_faults
    assert not turned.extended(posterior.assign(rotation)).frame_faults


def test_plots_of_the_base_model_are_refused_and_its_search_is_the_bases(extended, criticised):
    for plot in (extended.plot_fit, extended.plot_posterior):
        with pytest.raises(ValueError, match="camera_delay"):
            plot()
    bl.Criticism.open(criticised).base.plot_fit()
    figure = new_figure(6.0, 6.0)
    assert extended.plot_search(figure.subplots(3, 1, squeeze=False)).shape == (3, 1)


def test_it_can_be_criticised(extended, calibration):
    theta, signals, seeds = extended.learned_from
    assert set(theta) == {"viscosity", "cohesion"}
    np.testing.assert_array_equal(seeds, calibration.learned_from[2])
    assert len(signals) == len(seeds)


def test_results_travel(extended, criticised, pour):
    criticism = bl.Criticism.open(criticised)
    for one in (extended, criticism, pour):
        assert repr(pickle.loads(pickle.dumps(one))) == repr(one)
    again = pickle.loads(pickle.dumps(extended))
    np.testing.assert_array_equal(again.posterior["viscosity"], extended.posterior["viscosity"])


def of_another(path):
    run = Run.open(path)
    tree = run.required("criticise")
    run.keep("criticise", tree, {"after": "another"}, json.loads(tree.attrs["summary"]))


def damage(path):
    (path / "criticism.nc").write_bytes(b"cut off")


@pytest.mark.parametrize("spoil", [of_another, damage])
def test_a_criticism_that_is_damaged_or_of_another_posterior_does_not_count(
    criticised, calibration, spoil
):
    spoil(criticised)
    for read in (latest_of, bl.Criticism.open, bl.choose_pour):
        with pytest.raises(InputError, match=r"criticism\.nc .*bolfi-liquids criticise"):
            read(criticised)
    with pytest.raises(InputError, match="bolfi-liquids criticise"):
        bl.Criticism.open(calibration.path)  # was not criticised


def test_no_pour_is_chosen_over_a_posterior_that_is_not_the_latest(criticised):
    base = bl.Criticism.open(criticised).base
    with pytest.raises(InputError, match="another posterior.*RUN directory"):
        bl.choose_pour(base, progress=False)


def test_a_finished_criticism_leaves_what_design_wrote(criticised, monkeypatch):
    designed = criticised / next_stir.FILE
    designed.write_text("speed = 0.1\n")
    made_from = bl.Criticism.open(criticised).made_from
    same = SimpleNamespace(compared=[], left_out=[], table=None, made_from=made_from)
    module = import_module("bolfi_liquids.criticism.criticise")
    monkeypatch.setattr(module, "open_inputs", lambda *_: same)
    bl.criticise(criticised, progress=False)
    assert designed.read_text() == "speed = 0.1\n"
