"""The check against a reference's pours: results, going on, and the command."""

import json

import numpy as np
import pytest
import strip_pours
from typer.testing import CliRunner

from bolfi_liquids.checks import pour_replay
from bolfi_liquids.checks.against import Replays, check_against
from bolfi_liquids.checks.reference import open_reference
from bolfi_liquids.cli.app import app
from bolfi_liquids.errors import InputError

NAMES = strip_pours.NAMES


@pytest.fixture
def check(pours, off, tmp_path):
    """Runs the check, and tells whose pours were simulated together."""
    calls = []

    def run(names=(), simulate=None, cell=None, **more):
        simulate = simulate or off()

        def told(liquid, seeds, width):
            if len(liquid.pours) > 1:  # not the one that compiles
                calls.append((liquid.name, width))
            return simulate(liquid, seeds, width)

        replays = Replays(open_reference(pours), tuple(names), pour=told, cell=cell)
        return check_against(tmp_path / "out", replays, progress=False, **more)

    run.calls = calls
    return run


@pytest.mark.usefixtures("drawn")
def test_a_check_leaves_records_plots_and_one_results_file(check):
    found = check(seed=3)
    assert found.passed and found.ran == NAMES and found.stirs == ()
    assert [record["name"] for record in found.pours] == list(NAMES)
    results = json.loads(found.results.read_text())
    assert results["passed"] is True and results["recordings"] == {}
    assert set(results["reference"]["truths"]) == {"pour_truths.csv"}
    assert results["settings"]["pours"]["max_mean_rms"] == 0.085
    assert results["settings"]["pours"]["max_shift_errors"][-1] == {
        "viscosity_below": None,
        "max_mm": 4.0,
    }
    thin = results["pours"]["thin_contact_60"]
    assert thin["settings"]["surface_tension"] == 0.06 and "panels" not in thin
    assert [pour["angular_velocity_deg_s"] for pour in thin["notes"]["pours"]] == [45.0, 90.0]
    rows = {row["quantity"]: row for row in results["across_pours"]}
    assert len(rows) == 8 and all(row["passed"] for row in rows.values())
    assert results["passed"] and rows["mean RMS, pours.csv"]["tolerance"] == 0.085
    for name in NAMES:
        for ending in ("json", "svg"):
            assert (found.path / "against" / f"{name}.{ending}").exists()


def test_a_liquid_beyond_its_bar_fails(check, off):
    found = check(["thick_contact_60"], off(thick_contact_60=0.02))
    assert not found.pours[0]["passed"] and not found.passed


def test_wetting_that_changes_nothing_fails(check, off):
    """Each angle keeps its own bars, halfway between the two."""
    half = off(thin_contact_60=0.0035, thin_contact_110=-0.0015)
    found = check(["thin_contact_60", "thin_contact_110"], half)
    assert all(record["passed"] for record in found.pours)
    shifts = [row for row in found.across_pours if row.quantity.startswith("shift, thin")]
    assert len(shifts) == 2 and not any(row.passed for row in shifts) and not found.passed


def test_an_interrupted_check_goes_on_without_repeating_what_has_finished(check, off):
    def interrupted(liquid, seeds, cell):
        if liquid.name == "filmy_contact_30":
            raise KeyboardInterrupt
        return off()(liquid, seeds, cell)

    with pytest.raises(KeyboardInterrupt):
        check(simulate=interrupted)
    assert check().ran == NAMES[2:] and check().ran == ()


@pytest.mark.parametrize("change", ["seed", "cell", "truth", "distance", "retained", "cups"])
def test_other_settings_run_again(check, pours, change):
    edits = {
        "truth": ("pour_truths.csv", "0.001,1000,0.06,110", "0.001,999,0.06,110"),
        "distance": ("wetting.csv", "thin,45.0,2.0,", "thin,45.0,2.1,"),
        "retained": ("wetting.csv", "thin,90.0,6.0,1000000,0,0", "thin,90.0,6.0,999000,1000,0"),
        "cups": ("cups.toml", "lip_height = 0.20", "lip_height = 0.21"),
    }
    check(["thin_contact_110"])
    if change in edits:
        file, old, new = edits[change]
        text = (pours / file).read_text()
        assert old in text
        (pours / file).write_text(text.replace(old, new, 1))
    again = {"seed": int(change == "seed"), "cell": 0.004 if change == "cell" else None}
    assert check(["thin_contact_110"], **again).ran == ("thin_contact_110",)
    assert len(check.calls) == 2


def test_pours_of_another_liquid_run_nothing_again(check, pours):
    check(["thin_contact_110"])
    edited = (pours / "wetting.csv").read_text().replace("thick,45.0,2.0,", "thick,45.0,2.1,")
    (pours / "wetting.csv").write_text(edited)
    assert check(["thin_contact_110"]).ran == ()


def test_pours_that_raise_cost_themselves_alone_and_are_tried_again(check, off):
    def breaks(liquid, seeds, cell):
        if liquid.name == "thin_contact_60":
            raise RuntimeError("lists overflowed")
        return off()(liquid, seeds, cell)

    found = check(simulate=breaks)
    assert not found.passed and found.pours[0]["error"] == "RuntimeError: lists overflowed"
    assert all(record["passed"] for record in found.pours[1:])
    assert check().ran == ("thin_contact_60",)


@pytest.mark.parametrize("cell", [0.0, 1e-4, 0.02, float("nan")])
def test_cells_that_do_not_fit_the_cup_are_refused(check, tmp_path, cell):
    with pytest.raises(InputError, match="^cell: .* mm is not between 0.56 and 9.3 mm; give a"):
        check(cell=cell)
    assert check.calls == [] and not (tmp_path / "out").exists()


def test_stirs_have_no_cells_to_choose(grid, tmp_path):
    replays = Replays(open_reference(grid), cell=0.004)
    with pytest.raises(InputError, match="^cell: there are no pours; leave it out"):
        check_against(tmp_path / "out", replays, progress=False)


@pytest.fixture
def command(pours, off, tmp_path, monkeypatch):
    """Types the command, with a simulator that knows the pours."""

    def typed(*arguments, retained=0.0, **moved):
        known = {one.name: one for one in open_reference(pours).pours}

        def landings(liquid, rates, cups, seeds, **fineness):
            (one,) = (
                one
                for one in known.values()
                if one.viscosity == liquid.viscosity and one.cups == cups
            )
            return off(retained, **moved)(_Rates(one.name, rates), seeds, None)

        monkeypatch.setattr(pour_replay, "landings", landings)
        words = ["check", "physics", "--against", pours, "--out", tmp_path / "out", *arguments]
        return CliRunner().invoke(app, list(map(str, words)))

    return typed


class _Rates:
    def __init__(self, name, angular_velocity):
        self.name, self.angular_velocity = name, angular_velocity


def test_the_command_prints_each_pour_each_liquid_and_what_needs_several(command, tmp_path):
    result = command()
    assert result.exit_code == 0, result.stderr + result.stdout
    for text in ("thick_contact_110", "deg/s", "best at", "CPU s a", "pass", "shift, thin"):
        assert text in result.stdout
    assert "poured liquids within their bars: 5 of 5" in result.stdout
    assert "bars across pours kept: 8 of 8" in result.stdout
    assert "recordings within" not in result.stdout
    assert f"results: {tmp_path}/out/against.json" in result.stdout
    assert "thin_contact_60 (1 of 5)" in result.stderr


def test_the_status_is_that_of_the_bars(command):
    result = command(thick_contact_60=0.02)
    assert result.exit_code == 1 and "FAIL" in result.stdout
    assert "poured liquids within their bars: 4 of 5" in result.stdout
    assert command("--case", "thin_contact_60", thick_contact_60=0.02).exit_code == 0


def test_an_error_and_a_failed_simulation_have_rows(command, check, off, monkeypatch):
    def fails(liquid, seeds, cell):
        if liquid.name == "thick_contact_60":
            raise RuntimeError("overflow [b]")
        landed = off()(liquid, seeds, cell)
        landed.position[:], landed.retained[:] = np.nan, np.nan
        return landed

    found = check(simulate=fails)
    monkeypatch.setattr("bolfi_liquids.checks.against.check_against", lambda *_, **__: found)
    result = command()
    assert result.exit_code == 1
    assert "ERROR" in result.stdout and "none" in result.stdout
    assert "thick_contact_60 failed: RuntimeError: overflow [b]; it is tried" in result.stdout


def test_cells_are_given_in_millimetres(command, tmp_path):
    assert command("--cell", "4", "--case", "thin_contact_60").exit_code == 0
    results = json.loads((tmp_path / "out/against.json").read_text())
    cups = results["pours"]["thin_contact_60"]["settings"]["cups"]
    assert cups["particles"] == round(4 * np.pi * 28.0**2 * 34.0 / 4.0**3)


def test_cells_of_cases_cannot_be_chosen(tmp_path):
    words = ["check", "physics", "--cell", "4", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert result.stderr.startswith("error: --cell: is for pours of a reference; add --against")
