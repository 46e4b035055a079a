"""The check against a reference solver: results, going on, and the command."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from bolfi_liquids.checks import replay
from bolfi_liquids.checks.against import Replays, check_against
from bolfi_liquids.checks.reference import open_reference
from bolfi_liquids.cli.app import app
from bolfi_liquids.errors import InputError

NAMES = ("water_v10", "oil_v10", "gel_v10")


@pytest.fixture
def check(grid, shifted, tmp_path):
    """Runs the check, and tells whose stirs were simulated as a whole."""
    calls = []

    def run(names=(), simulate=None, **more):
        simulate = simulate or shifted()

        def told(stir, seeds):
            if len(stir.recording.time) > replay.WARM_UP:
                calls.append(stir.name)
            return simulate(stir, seeds)

        replays = Replays(open_reference(grid), tuple(names), told)
        return check_against(tmp_path / "out", replays, progress=False, **more)

    run.calls = calls
    return run


@pytest.mark.usefixtures("drawn")
def test_a_check_leaves_records_plots_and_one_results_file(check):
    found = check(seed=3)
    assert found.passed and found.ran == NAMES
    assert found.left_out == {"hidden_oil_bubbles_v10": "bubbles"}
    assert [record["name"] for record in found.records] == list(NAMES)
    results = json.loads(found.results.read_text())
    assert results["passed"] is True and results["seed"] == 3
    assert results["model"] and results["versions"]["taichi"]
    assert results["reference"]["directory"] == "grid"
    assert results["settings"]["seeds"] == 8 and results["settings"]["noise_deg"] == 0.1
    assert results["settings"]["rms_bars"][-1] == {"viscosity_below": None, "max_deg": 0.1}
    water = results["recordings"]["water_v10"]
    assert water["settings"]["viscosity"] == 0.001 and water["settings"]["setup"]["cup"]
    assert water["notes"]["cpu_s"] >= 0.0 and "panels" not in water
    assert [pair["passed"] for pair in results["neighbours"]] == [True, True]
    assert results["left_out"] == {"hidden_oil_bubbles_v10": "bubbles"}
    for name in NAMES:
        for ending in ("json", "svg"):
            assert (found.path / "against" / f"{name}.{ending}").exists()


def test_a_recording_beyond_its_bar_fails(check, shifted):
    found = check(["gel_v10"], shifted(offset=0.3))
    assert not found.records[0]["passed"] and not found.passed


def test_too_small_a_difference_between_liquids_fails(check, reference):
    water = reference.stirs[0].recording.inclination

    def dull(stir, seeds):
        """Within the bars of thin liquids, which it does not tell apart."""
        shape = len(seeds), len(stir.recording.time), 2
        return np.broadcast_to(water[: shape[1]], shape)

    found = check(["water_v10", "oil_v10"], dull)
    assert found.records[0]["passed"]
    (pair,) = found.neighbours
    assert pair.simulated == 0.0 and not pair.passed and not found.passed


def test_an_interrupted_check_goes_on_without_repeating_what_has_finished(check, shifted):
    def interrupted(stir, seeds):
        if stir.name == "oil_v10":
            raise KeyboardInterrupt
        return shifted()(stir, seeds)

    with pytest.raises(KeyboardInterrupt):
        check(simulate=interrupted)
    assert check().ran == ("oil_v10", "gel_v10")
    assert check().ran == ()
    assert check.calls == ["water_v10", "oil_v10", "gel_v10"]  # broken off in the short stir


@pytest.mark.parametrize("change", ["seed", "viscosity", "recording"])
def test_other_settings_run_again(check, grid, change):
    check(["gel_v10"])
    if change == "viscosity":
        table = grid / "truths.csv"
        table.write_text(table.read_text().replace("gel_v10.nc,any,12,", "gel_v10.nc,any,11,"))
    elif change == "recording":
        (grid / "gel_v10.nc").write_bytes((grid / "oil_v10.nc").read_bytes())
    assert check(["gel_v10"], seed=int(change == "seed")).ran == ("gel_v10",)


def test_some_recordings_are_run_and_all_finished_ones_are_in_the_results(check):
    assert check(["gel_v10"]).ran == ("gel_v10",)
    found = check(["oil_v10.nc"])
    assert [record["name"] for record in found.records] == ["oil_v10"]
    assert found.neighbours == ()  # of what was asked for
    results = json.loads(found.results.read_text())
    assert list(results["recordings"]) == ["oil_v10", "gel_v10"]
    assert len(results["neighbours"]) == 1


def test_a_recording_that_raises_costs_itself_alone_and_is_tried_again(check, shifted):
    def breaks(stir, seeds):
        if stir.name == "oil_v10":
            raise RuntimeError("lists overflowed")
        return shifted()(stir, seeds)

    found = check(simulate=breaks)
    assert not found.passed and found.neighbours == ()
    assert [record["error"] for record in found.records] == [
        None,
        "RuntimeError: lists overflowed",
        None,
    ]
    assert check().ran == ("oil_v10",)


def test_bad_arguments_are_refused_before_anything_is_simulated_or_written(check, tmp_path):
    for more in ({"names": ["couette"]}, {"seed": -1}):
        with pytest.raises(InputError):
            check(**more)
    assert check.calls == [] and not (tmp_path / "out").exists()


@pytest.fixture
def command(grid, reference, tmp_path, monkeypatch):
    """Types the command, with a simulator that knows the recordings."""
    known = {stir.viscosity: stir.recording.inclination for stir in reference.stirs}

    def typed(*arguments, offset=0.0):
        def stir(liquid, gripper, setup, seeds, effects):
            signal = known[liquid.viscosity][: len(gripper.time)] + np.radians(offset)
            return np.broadcast_to(signal, (len(seeds), *signal.shape))

        monkeypatch.setattr(replay, "stir", stir)
        words = ["check", "physics", "--against", grid, "--out", tmp_path / "out", *arguments]
        return CliRunner().invoke(app, list(map(str, words)))

    return typed


def test_the_command_prints_both_tables_and_what_was_left_out(command, tmp_path):
    result = command()
    assert result.exit_code == 0, result.stderr
    for text in ("water_v10", "0.001", "[deg]", "CPU s", "0.36", "pass", "1 ± 0.25"):
        assert text in result.stdout
    assert (
        "left out, for they hold an effect of no known size: hidden_oil_bubbles_v10 (bubbles)"
        in result.stdout
    )
    assert "recordings within their bars: 3 of 3" in result.stdout
    assert "pairs within their bar: 2 of 2 judged" in result.stdout
    assert f"results: {tmp_path}/out/against.json" in result.stdout
    assert "water_v10 (1 of 3)" in result.stderr


def test_the_status_is_that_of_the_bars(command):
    result = command(offset=0.3)
    assert result.exit_code == 1
    assert "FAIL" in result.stdout and "recordings within their bars: 2 of 3" in result.stdout
    assert command("--case", "oil_v10", offset=0.3).exit_code == 0


def test_a_case_of_the_fluid_is_no_recording(command, tmp_path):
    result = command("--case", "couette")
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("error: --case: no recording or pour 'couette' in ")
    assert "or leave --against out to run other cases" in line
    assert not (tmp_path / "out").exists()


def test_an_error_and_a_failed_simulation_have_a_row(command, check, shifted, monkeypatch):
    def fails(stir, seeds):
        if stir.name == "gel_v10":
            raise RuntimeError("overflow [b]")
        return np.full((len(seeds), len(stir.recording.time), 2), np.nan)

    found = check(simulate=fails)
    monkeypatch.setattr("bolfi_liquids.checks.against.check_against", lambda *_, **__: found)
    result = command()
    assert result.exit_code == 1
    assert "ERROR" in result.stdout and "none" in result.stdout
    assert "gel_v10 failed: RuntimeError: overflow [b]; it is tried again" in result.stdout
