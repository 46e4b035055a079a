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
from bolfi_liquids.inputs.cups import bundled_cups
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


def test_fractions_add_up_and_the_action_is_allowed(pour, pour_settings):
    cups = pour_settings["cups"]
    for judged in (pour.chosen, pour.plug_in):
        np.testing.assert_allclose(judged.fractions.sum(axis=1), 1.0)
        assert (judged.fractions >= 0).all()
        low, high = cups.angular_velocity_range
        assert low <= judged.angular_velocity <= high
        low, high = cups.distance_range
        assert low <= judged.distance <= high
        assert judged.expected_spillage <= judged.fractions[:, 0].max()


def test_chosen_spills_no_more_than_the_plug_in(pour):
    difference = by_draw(pour.chosen) - by_draw(pour.plug_in)
    assert difference.mean() <= 4.0 * difference.std(ddof=1) / np.sqrt(len(difference))


def by_draw(judged):
    """Spilled fraction of each posterior draw, whose landings are no independent outcomes."""
    return judged.fractions[:, 0].reshape(-1, LANDINGS_PER_DRAW).mean(axis=1)


def test_chosen_is_among_the_better_actions(pour):
    risk = xr.load_datatree(pour.path / "pour.nc")["actions"]["risk"].to_numpy()
    assert pour.chosen.expected_spillage < np.quantile(risk, 0.2)


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


def test_no_draw_that_judges_has_chosen(pour, calibration, pour_settings):
    search, judge = strata(calibration, pour_settings["draws"], 0)
    assert not np.isin(judge["viscosity"], search["viscosity"]).any()
    liquids = xr.load_datatree(pour.path / "pour.nc")["liquids"]
    np.testing.assert_array_equal(liquids["viscosity"], search["viscosity"])
    assert len(pour.chosen.fractions) % (LANDINGS_PER_DRAW * len(judge["viscosity"])) == 0


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


def test_section_is_of_the_pour(pour, calibration, pour_settings):
    section = json.loads((pour.path / "summary.json").read_text())["pour"]
    assert section["expected_spillage"] == pytest.approx(pour.chosen.fractions[:, 0].mean())
    assert section["spillage_q95"] == pytest.approx(np.quantile(pour.chosen.fractions[:, 0], 0.95))
    assert section["angular_velocity_deg_s"] == pytest.approx(
        np.degrees(pour.chosen.angular_velocity)
    )
    assert section["distance_cm"] == pytest.approx(100 * pour.chosen.distance)
    floor = bundled_cups().least_viscosity(calibration.liquid_density)
    assert section["least_viscosity"] == pytest.approx(floor, rel=1e-12) and floor > 0.0
    plug_in = section["plug_in"]["expected_spillage"]
    assert plug_in == pytest.approx(pour.plug_in.expected_spillage, rel=1e-12)
    tree = xr.load_datatree(pour.path / "pour.nc")
    assert section["n_simulations"] == pour_settings["budget"] == tree["pours"].sizes["pour"]
    missed = tree["pours"]["missed"].to_numpy()
    assert section["map_error"] == pytest.approx(np.sqrt(np.mean(missed**2)), rel=1e-9)
    assert section["map_error"] == tree.attrs["map_error"]
    assert bl.Calibration.open(pour.path).summary == calibration.summary  # left as it was


def test_choosing_again_simulates_nothing(pour, pour_settings):
    before = rows(pour.path)
    again = bl.choose_pour(pour.path, **pour_settings, progress=False)
    assert rows(pour.path) == before
    np.testing.assert_array_equal(again.chosen.fractions, pour.chosen.fractions)


def test_more_draws_than_there_are_is_said_in_the_setting_s_terms(calibration):
    with pytest.raises(ValueError, match=r"^draws: 1334 needs 4002 posterior draws.*give 1333"):
        bl.choose_pour(calibration, draws=1334, progress=False)


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("budget", 23),
        ("budget", 101),
        ("iterations", 2),
        ("draws", 0),
        ("risk", "median"),
        ("seed", -1),
    ],
)
def test_bad_setting_is_named(calibration, setting, value):
    with pytest.raises(ValueError, match=f"^{setting}: {value!r}"):
        bl.choose_pour(calibration, progress=False, **{setting: value})


def test_a_pour_is_read_as_it_was_written(pour):
    again = bl.Pour.open(pour.path)
    for name in ("chosen", "plug_in"):
        judged, read = getattr(pour, name), getattr(again, name)
        assert read.action == judged.action
        np.testing.assert_array_equal(read.fractions, judged.fractions)
    summary = again.summary
    assert summary.expected_spillage == pour.chosen.expected_spillage
    assert PourSummary.from_json(summary.to_json()) == summary


def test_a_pour_shows_what_was_chosen(pour):
    speed = f"{np.degrees(pour.chosen.angular_velocity):.1f} deg/s"
    for shown in (repr(pour), pour._repr_html_()):
        assert str(pour.path) in shown and speed in shown


@pytest.mark.parametrize("given", [False, True])
def test_the_map_marks_both_actions_among_the_risks(pour, given):
    figure = new_figure(4.0, 3.0)
    axes = figure.subplots() if given else None
    drawn = pour.plot_map(axes)
    assert (drawn is axes) == given
    marked = {line.get_label(): line.get_xydata()[0] for line in drawn.get_lines()}
    for label, judged in (("chosen pour", pour.chosen), ("best at θ* alone", pour.plug_in)):
        at = np.degrees(judged.angular_velocity), 100.0 * judged.distance
        np.testing.assert_allclose(marked[label], at)


def test_a_pour_that_is_not_the_run_s_own_is_refused(pour):
    chosen = pour.chosen
    others = (
        replace(chosen, distance=chosen.distance + 1e-3),
        replace(chosen, fractions=chosen.fractions[:, ::-1]),
    )
    for other in others:
        with pytest.raises(ValueError, match="another pour"):
            replace(pour, chosen=other).check_current(bl.Pour.open(pour.path))


def test_a_run_without_a_pour_says_how_to_choose_one(calibration):
    with pytest.raises(InputError, match="bolfi-liquids pour"):
        bl.Pour.open(calibration.path)
