"""A pour is chosen over the posterior, and judged by seeds that did not choose it."""

import json
import shutil
import sqlite3
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.simulations import Compute
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids import models
from bolfi_liquids.cli.app import app
from bolfi_liquids.drawing import new_figure
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.settings import PourSettings
from bolfi_liquids.pouring.choose import decided, strata
from bolfi_liquids.pouring.landing_map import LANDINGS_PER_DRAW
from bolfi_liquids.pouring.result import PourSummary
from bolfi_liquids.run.run import SIMULATIONS, Run


def rows(run):
    connection = sqlite3.connect(run / SIMULATIONS)
    count = connection.execute("SELECT count(*) FROM simulation").fetchone()[0]
    connection.close()
    return count


@pytest.fixture
def far_off(pour, tmp_path, with_numbers):
    """A run with a pour, whose fit is bad."""
    run = shutil.copytree(pour.path, tmp_path / "far")
    return with_numbers(run, fit_rms_deg=2.1, noise_deg=0.24)


def test_no_pour_is_chosen_over_a_bad_fit(far_off):
    before = rows(far_off)
    for given in (far_off, bl.Calibration.open(far_off)):
        with pytest.raises(InputError, match="8.7 times") as refused:
            bl.choose_pour(given, progress=False)
        assert refused.value.where == str(far_off) and "force" in refused.value.fix
    result = CliRunner().invoke(app, ["pour", str(far_off)])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert "--force" in line and "8.7 times" in line
    assert rows(far_off) == before


def test_a_person_may_insist(far_off, pour, pour_settings):
    again = bl.choose_pour(far_off, **pour_settings, force=True, progress=False)
    assert again.chosen.action == pour.chosen.action
    assert rows(far_off) == rows(pour.path)
    for run, status in ((far_off, "bad"), (pour.path, "acceptable")):
        tree = Run.open(run).required("pour")
        assert bl.Pour.open(run).summary.fit_status == tree.attrs["fit_status"] == status


def test_the_chosen_action_is_allowed_and_among_the_better_ones(pour, pour_settings):
    cups = pour_settings["cups"]
    for judged in (pour.chosen, pour.plug_in):
        np.testing.assert_allclose(judged.fractions.sum(axis=1), 1.0)
        assert (judged.fractions >= 0).all()
        low, high = cups.angular_velocity_range
        assert low <= judged.angular_velocity <= high
        low, high = cups.distance_range
        assert low <= judged.distance <= high
    difference = by_draw(pour.chosen) - by_draw(pour.plug_in)
    assert difference.mean() <= 4.0 * difference.std(ddof=1) / np.sqrt(len(difference))
    risk = xr.load_datatree(pour.path / "pour.nc")["actions"]["risk"].to_numpy()
    assert pour.chosen.expected_spillage < np.quantile(risk, 0.2)


def by_draw(judged):
    """Spilled fraction of each posterior draw, whose landings are no independent outcomes."""
    return judged.fractions[:, 0].reshape(-1, LANDINGS_PER_DRAW).mean(axis=1)


@pytest.mark.slow
def test_new_pours_agree_with_the_judgement(pour, calibration, pour_settings):
    """Of other draws, with other seeds and the landing off as much: no map is asked."""
    tree = xr.load_datatree(pour.path / "pour.nc")
    known = calibration.posterior["viscosity"].to_numpy()
    assert np.isin(tree["liquids"]["viscosity"], known).all()
    cups, count, rng = pour_settings["cups"], 64, np.random.default_rng(0)
    liquid = models.Liquid(**calibration.draws(count, 99), density=calibration.liquid_density)
    landed = models.landings(liquid, pour.chosen.angular_velocity, cups, np.arange(count))
    off = rng.normal(0.0, tree.attrs["landing_sd"], (40, 1))
    spilled = landed.into(pour.chosen.distance - off, cups.receiver.radius).spilled.mean(axis=0)
    judged = by_draw(pour.chosen)
    chance = spilled.std(ddof=1) * np.sqrt(1 / count + 1 / len(judged))
    error = np.hypot(chance, tree.attrs["map_error"])
    assert abs(spilled.mean() - judged.mean()) < 4.0 * error


def test_the_action_is_that_of_pours_known_in_closed_form(made_up, calibration, tmp_path):
    """Where the middle of the stream meets that of the receiver, for the liquid of the middle."""
    run = shutil.copytree(calibration.path, tmp_path / "run")
    pour = bl.choose_pour(run, force=True, progress=False)
    assert sum(made_up.calls) == 64 and max(made_up.calls) <= 8
    liquid = {name: float(np.median(v)) for name, v in calibration.posterior.items()}
    middle = made_up.middle(**liquid, rate=pour.chosen.angular_velocity)
    assert pour.chosen.distance == pytest.approx(middle, abs=0.006)
    best = made_up.middle(**calibration.best, rate=pour.plug_in.angular_velocity)
    assert pour.plug_in.distance == pytest.approx(best, abs=0.006)


def test_no_draw_that_judges_has_chosen(calibration):
    search, judge = strata(calibration, 16, 0)
    assert (len(search["viscosity"]), len(judge["viscosity"])) == (16, 32)
    assert not np.isin(judge["viscosity"], search["viscosity"]).any()


def test_an_effect_that_does_not_act_in_pours_needs_no_new_ones(
    made_up, calibration, pour_settings, tmp_path
):
    run = bl.Calibration.open(shutil.copytree(calibration.path, tmp_path / "run"))
    more = {**pour_settings, "force": True, "progress": False}
    bl.choose_pour(run, **more)
    before = len(made_up.calls)
    cups = pour_settings["cups"]
    settings = PourSettings(**{k: v for k, v in pour_settings.items() if k != "cups"})
    decided(extended(run, "camera_tilt"), cups, settings, Compute())
    assert len(made_up.calls) == before
    tree = decided(extended(run, "adhesion"), cups, settings, Compute()).tree
    count = pour_settings["budget"]
    assert sum(made_up.calls) == 2 * count
    assert (tree["pours"]["adhesion"] == 0.0).sum() == count < tree["pours"].sizes["pour"]


def extended(calibration, effect):
    """As a criticism that accepted an effect gives it, whose coefficient is 0 to 0.3."""
    tree = calibration.tree.copy()
    posterior = tree["posterior"].to_dataset()
    drawn = 0.3 * np.random.default_rng(1).random(posterior["viscosity"].shape)
    tree["posterior"] = xr.DataTree(posterior.assign({effect: (("chain", "draw"), drawn)}))
    summary = replace(calibration.summary, best={**calibration.best, effect: 0.15})
    return replace(calibration, tree=tree, summary=summary)


def test_draws_that_were_changed_are_not_poured(made_up, calibration, pour_settings, tmp_path):
    run = bl.Calibration.open(shutil.copytree(calibration.path, tmp_path / "run"))
    run.tree["posterior"]["viscosity"][:] *= 2.0
    with pytest.raises(InputError, match="another posterior"):
        bl.choose_pour(run, **pour_settings, force=True, progress=False)
    assert not made_up.calls


def test_a_choice_that_was_killed_goes_on_from_its_pours(
    made_up, calibration, pour_settings, tmp_path
):
    """It ends with the same bits, and pours what it lacked alone."""
    runs = [shutil.copytree(calibration.path, tmp_path / name) for name in ("whole", "killed")]
    more = {**pour_settings, "force": True, "progress": False}
    whole = bl.choose_pour(runs[0], **more)
    made_up.calls.clear()
    landings = models.landings

    def dying(*given, **more):
        if sum(made_up.calls) >= 8:
            raise KeyboardInterrupt
        return landings(*given, **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(models, "landings", dying)
        with pytest.raises(KeyboardInterrupt):
            bl.choose_pour(runs[1], **more)
    again = bl.choose_pour(runs[1], **more)
    assert sum(made_up.calls) == pour_settings["budget"]
    assert again.chosen.equals(whole.chosen) and again.plug_in.equals(whole.plug_in)


def test_section_and_file_are_of_the_pour(pour, calibration, pour_settings):
    section = json.loads((pour.path / "summary.json").read_text())["pour"]
    for judged, held in ((pour.chosen, section), (pour.plug_in, section["plug_in"])):
        spilled, received, _ = judged.fractions.T
        assert held["expected_spillage"] == pytest.approx(spilled.mean())
        assert held["spillage_q95"] == pytest.approx(np.quantile(spilled, 0.95))
        assert held["received_q05"] == pytest.approx(np.quantile(received, 0.05))
        assert held["angular_velocity_deg_s"] == pytest.approx(np.degrees(judged.angular_velocity))
        assert held["distance_cm"] == pytest.approx(100 * judged.distance)
    floor = pour_settings["cups"].least_viscosity(calibration.liquid_density)
    assert section["least_viscosity"] == pytest.approx(floor, rel=1e-12) and floor > 0.0
    tree = xr.load_datatree(pour.path / "pour.nc")
    search, judge = strata(calibration, pour_settings["draws"], 0)
    np.testing.assert_array_equal(tree["liquids"]["viscosity"], search["viscosity"])
    assert len(pour.chosen.fractions) % (LANDINGS_PER_DRAW * len(judge["viscosity"])) == 0
    assert section["n_simulations"] == pour_settings["budget"] == tree["pours"].sizes["pour"]
    missed = tree["pours"]["missed"].to_numpy()
    assert section["map_error"] == pytest.approx(np.sqrt(np.mean(missed**2)), rel=1e-9)
    assert section["map_error"] == tree.attrs["map_error"]
    assert bl.Calibration.open(pour.path).summary == calibration.summary  # left as it was


@pytest.mark.parametrize(("setting", "value"), [("budget", 101), ("draws", 1334)])
def test_bad_setting_is_named(calibration, setting, value):
    with pytest.raises(InputError) as refused:
        bl.choose_pour(calibration, progress=False, **{setting: value})
    assert refused.value.where == setting and str(value) in str(refused.value)


def test_a_pour_is_read_as_it_was_written(pour, pour_settings):
    before, again = rows(pour.path), bl.Pour.open(pour.path)
    chosen_again = bl.choose_pour(pour.path, **pour_settings, progress=False)
    for other in (again, chosen_again):
        assert other.chosen.equals(pour.chosen) and other.plug_in.equals(pour.plug_in)
        assert other.summary == PourSummary.from_json(other.summary.to_json()) == pour.summary
    assert rows(pour.path) == before
    speed = f"{np.degrees(pour.chosen.angular_velocity):.1f} deg/s"
    for shown in (repr(pour), pour._repr_html_()):
        assert str(pour.path) in shown and speed in shown


def test_the_map_marks_both_actions_among_the_risks(pour):
    axes = new_figure(4.0, 3.0).subplots()
    assert pour.plot_map(axes) is axes
    marked = {line.get_label(): line.get_xydata()[0] for line in pour.plot_map().get_lines()}
    for label, judged in (("chosen pour", pour.chosen), ("best at θ* alone", pour.plug_in)):
        at = np.degrees(judged.angular_velocity), 100.0 * judged.distance
        np.testing.assert_allclose(marked[label], at)
