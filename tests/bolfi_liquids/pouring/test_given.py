"""Pours that were given count in what is expected, in its interval and in the choice."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.inference.simulations import Compute
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids import inference, models
from bolfi_liquids.cli.app import app
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.pouring.pours import Draining, hold_of
from bolfi_liquids.reporting.warnings import Results, warnings_of
from bolfi_liquids.run.given_pours import GIVEN_POURS, digest_of_pours, keep_pours, kept_pours
from bolfi_liquids.run.run import Run
from bolfi_liquids.simulators import PourSimulator

HEADER = "angular_velocity_deg_s,distance_cm,spilled,received,retained"
MORE = {"force": True, "progress": False}


def written(path, rows, header=HEADER):
    """A table of pours: deg/s, cm and three shares each."""
    lines = [",".join(f"{value:g}" for value in row) for row in rows]
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def first_choice(make_up, calibration, tmp_path_factory):
    """A run whose pour was chosen without given pours, which are made up."""
    run = shutil.copytree(calibration.path, tmp_path_factory.mktemp("chosen") / "run")
    with pytest.MonkeyPatch.context() as patch:
        make_up(patch)
        bl.choose_pour(run, **MORE)
    return run


@pytest.fixture
def chosen(made_up, first_choice, tmp_path):
    """The same, to be altered."""
    return bl.Pour.open(shutil.copytree(first_choice, tmp_path / "run"))


def contradicting(chosen, tmp_path, name="given.csv"):
    """What was chosen spilled much, and little was spilled where the map expects very much."""
    rate, distance = np.degrees(chosen.chosen.angular_velocity), 100.0 * chosen.chosen.distance
    kept = float(chosen.chosen.fractions[:, 2].mean())
    bad = [(rate, at, 0.2, 0.8 - kept, kept) for at in distance + np.array([-0.5, 0.0, 0.5])]
    good = [(90.0, at, 0.01, 0.99 - kept, kept) for at in (6.0, 6.5, 7.0)]
    return written(tmp_path / name, bad + good)


def test_a_row_that_contradicts_the_choice_moves_it(chosen, tmp_path):
    table = contradicting(chosen, tmp_path)
    moved = bl.choose_pour(chosen.path, given=table, **MORE)
    assert np.degrees(moved.chosen.angular_velocity) == pytest.approx(90.0, rel=0.3)
    assert moved.chosen.distance > 0.055
    assert moved.chosen.expected_spillage < 0.03 and moved.chosen.spillage_q95 < 0.06
    given = moved.summary.given
    assert {pour.line for pour in given.nearest} == {5, 6, 7}
    # by what would be chosen without them as much is spilled as was seen
    rate, distance = given.without.action
    assert np.radians(rate) == pytest.approx(chosen.chosen.angular_velocity)
    assert distance / 100.0 == pytest.approx(chosen.chosen.distance)
    assert given.without.expected_spillage == pytest.approx(0.2, abs=0.03)


def test_expectation_and_interval_are_those_of_what_was_seen(chosen, tmp_path, calibration):
    """At an action that was poured five times they are its spillage and repeatability."""
    at = np.degrees(chosen.chosen.angular_velocity), 100.0 * chosen.chosen.distance
    kept = float(chosen.chosen.fractions[:, 2].mean())
    rows = [(*at, spilled, 0.95 - kept - spilled, kept + 0.05) for spilled in [0.1] * 5]
    pour = bl.choose_pour(chosen.path, given=written(tmp_path / "t.csv", rows), **MORE)
    judged = pour.summary.given.without
    assert judged.action == pytest.approx((at[0], at[1]))
    assert judged.expected_spillage == pytest.approx(0.1, abs=0.01)
    assert judged.expected_retained == pytest.approx(kept + 0.05, abs=0.015)
    assert 0.11 < judged.spillage_q95 < 0.16
    # the choice was made by the same expectation
    actions = Run.open(pour.path).required("pour")["actions"].to_dataset()
    place = actions["risk"].sel(
        angular_velocity=np.radians(at[0]), distance=at[1] / 100.0, method="nearest"
    )
    assert float(place) == pytest.approx(judged.expected_spillage, abs=0.01)


def test_pours_as_expected_leave_the_choice_where_it_is(chosen, tmp_path):
    judged = chosen.chosen
    at = np.degrees(judged.angular_velocity), 100.0 * judged.distance
    shares = judged.fractions.mean(axis=0)
    rows = [(at[0], at[1] + off, *shares) for off in (-0.1, 0.0, 0.1)]
    again = bl.choose_pour(chosen.path, given=written(tmp_path / "t.csv", rows), **MORE).chosen
    assert again.distance == pytest.approx(judged.distance, abs=0.005)
    assert again.expected_spillage == pytest.approx(judged.expected_spillage, abs=0.005)


def test_a_pour_of_another_table_is_out_of_date_and_without_any_nothing_has_changed(
    chosen, tmp_path
):
    bl.choose_pour(chosen.path, given=contradicting(chosen, tmp_path), **MORE)
    assert not Run.open(chosen.path).why_not("pour")
    (chosen.path / GIVEN_POURS).unlink()
    assert "given pours" in Run.open(chosen.path).why_not("pour")
    again = bl.choose_pour(chosen.path, **MORE)
    assert not Run.open(chosen.path).why_not("pour")
    assert again.chosen.equals(chosen.chosen) and again.plug_in.equals(chosen.plug_in)
    assert again.summary == chosen.summary and again.summary.given is None


def test_every_command_means_the_same_by_a_table(chosen, tmp_path, calibration, pour_settings):
    """A run keeps the last table that any command was given, and pours by it."""
    table = contradicting(chosen, tmp_path)
    by_pour = bl.choose_pour(chosen.path, given=table, **MORE)
    (recording,) = (calibration.path / "recordings").glob("*.nc")
    settings = {k: v for k, v in calibration.record["settings"].items() if k != "prior"}
    other = shutil.copytree(calibration.path, tmp_path / "other")
    bl.calibrate(recording, out=other, resume=True, pours=table, progress=False, **settings)
    by_calibrate = bl.choose_pour(other, **MORE)
    assert by_calibrate.chosen.equals(by_pour.chosen)
    assert by_calibrate.summary.given == by_pour.summary.given
    again = bl.choose_pour(chosen.path, **MORE)  # without naming it once more
    assert again.chosen.equals(by_pour.chosen)


def test_section_and_file_say_which_pours_count(chosen, tmp_path):
    table = contradicting(chosen, tmp_path)
    text = table.read_text(encoding="utf-8")
    table.write_text(text + "20,3.0,0.5,0.4,0.1\n", encoding="utf-8")  # slower than is allowed
    pour = bl.choose_pour(chosen.path, given=table, **MORE)
    opened = bl.open_pours(table)
    section = json.loads((pour.path / "summary.json").read_text())["pour"]["given"]
    assert section["sha256"] == opened.hash and section["file"] == table.name
    assert section["lines"] == [2, 3, 4, 5, 6, 7]
    kept = Run.open(pour.path).required("pour")["given"].to_dataset()
    np.testing.assert_array_equal(kept["spilled"], opened.fractions[:6, 0])
    np.testing.assert_array_equal(kept["line"], section["lines"])
    assert bl.Pour.open(pour.path).summary == pour.summary


def test_what_counts_of_a_table_is_its_content_liquid_and_cups(tmp_path):
    rows, cups = [(20.0, 3.0, 0.1, 0.8, 0.1), (20.0, 4.0, 0.2, 0.7, 0.1)] * 2, bundled_cups()
    table = bl.open_pours(written(tmp_path / "a.csv", rows))
    renamed = bl.open_pours(written(tmp_path / "b.csv", rows))
    shorter = bl.open_pours(written(tmp_path / "c.csv", rows[:3]))
    wider = cups.model_copy(update={"receiver": cups.receiver.model_copy(update={"radius": 0.03})})

    def digest(table, cups=cups):
        keep_pours(tmp_path, table, cups)
        return digest_of_pours(tmp_path)

    assert digest(table) == digest(renamed) and kept_pours(tmp_path, cups).path == Path("b.csv")
    others = {digest(shorter), digest(replace(table, liquid="water")), digest(table, wider)}
    (tmp_path / GIVEN_POURS).write_bytes(b"cut off")
    others.add(digest_of_pours(tmp_path))
    assert len(others) == 4 and digest(table) not in others


def test_pours_of_other_cups_do_not_count(chosen, tmp_path, caplog):
    table = contradicting(chosen, tmp_path)
    bundled = bundled_cups()
    receiver = bundled.receiver.model_copy(update={"radius": 0.03})
    bl.choose_pour(
        chosen.path, bundled.model_copy(update={"receiver": receiver}), given=table, **MORE
    )
    again = bl.choose_pour(chosen.path, **MORE)
    assert again.chosen.equals(chosen.chosen) and "other cups" in caplog.text
    assert kept_pours(chosen.path, bundled) is None
    narrower = bundled.pour.model_copy(update={"distance": (0.0, 0.06)})
    plan = bundled.model_copy(update={"pour": narrower, "receiver": receiver})
    assert kept_pours(chosen.path, plan) is not None  # only other actions may be chosen


def test_pours_beyond_every_action_are_refused(chosen, tmp_path):
    rows = [(20.0, at, 0.1, 0.8, 0.1) for at in (1.0, 2.0, 3.0)]
    with pytest.raises(InputError, match="none of its 3 pours"):
        bl.choose_pour(chosen.path, given=written(tmp_path / "slow.csv", rows), **MORE)


def test_the_terminal_shows_the_pours_beside_the_choice(chosen, tmp_path):
    table, run = contradicting(chosen, tmp_path), str(chosen.path)
    result = CliRunner().invoke(app, ["pour", run, "--given", str(table), "--force"])
    assert result.exit_code == 0, result.output
    assert "line 5" in result.output and "contradict" in " ".join(result.output.split())
    refused = CliRunner().invoke(app, ["pour", run, "--liquid", "oil"])
    assert refused.exit_code == 2 and "--given" in refused.stderr


@pytest.mark.parametrize("power", [0.65, 0.4, 0.2])
def test_how_long_the_source_must_be_held(monkeypatch, power):
    """Half of the liquid stays at first; from half a second on it thins as a power of time."""

    def draining(batch, held):
        assert held[-1] <= batch.cups.pour.hold
        return np.tile(0.5 * (np.maximum(held, 0.5) / 0.5) ** -power, (len(batch.seeds), 1))

    monkeypatch.setattr(models, "draining", draining)
    liquids = {"viscosity": np.geomspace(1.0, 9.0, 16), "cohesion": np.full(16, 0.5)}
    with inference.SimulationBank(":memory:") as bank:
        pours = PourSimulator(bundled_cups(), 1000.0, Draining())
        hold = hold_of(pours, 1.0, liquids, Compute(bank=bank))
    until = 0.5 * 5.0 ** (1.0 / power)  # 6, 28 and 1563 s
    known = until if until < 60.0 else np.nan
    assert hold.until_tenth_s == pytest.approx(known, abs=0.1, nan_ok=True)
    assert hold.retained_then == pytest.approx(0.5 * (hold.simulated_s / 0.5) ** -power)


def test_what_stays_is_told_with_the_hold_where_it_is_much(chosen, monkeypatch):
    share, hold = chosen.chosen.fractions[:, 2].mean(), chosen.summary.hold
    assert chosen.summary.expected_retained == share > 0.1
    warnings = warnings_of(Results.of(Run.open(chosen.path)))
    (text,) = [one for one in warnings if one.startswith(f"{100.0 * share:.0f} %")]
    assert f"{hold.until_tenth_s:.2g} s" in text and "0.9 s" in text
    monkeypatch.setattr("bolfi_liquids.pouring.choose.TENTH", share + 0.01)  # little, then
    again = bl.choose_pour(chosen.path, **MORE)
    assert again.summary.hold is None and again.chosen.equals(chosen.chosen)
