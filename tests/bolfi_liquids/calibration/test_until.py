"""A calibration that ends before its budget, once it knows enough."""

import tomllib

import numpy as np
import pytest
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.calibration import calibrate as calibrating
from bolfi_liquids.calibration.until import Goal
from bolfi_liquids.cli.app import app
from bolfi_liquids.errors import InputError
from bolfi_liquids.reporting.facts import calibration_facts

QUICK = {"batch": 2, "particles": 200, "seed": 5, "sampler": "emcee", "chains": 2, "draws": 100}
FIRST_LOOK = 16  # 10 in the start design, and five more, in batches of two
SOONEST = 22  # another five


def interrupted(fit):
    raise KeyboardInterrupt


def goal(error):
    return Goal("intervals=0.25", 0.25, lambda *_: error)


ENOUGH = goal(lambda fit: 0.12 if len(fit.history.theta) >= FIRST_LOOK else 1.0)


def draws_of(calibration):
    return np.stack(list(calibration.posterior.values()))


@pytest.mark.slow
def test_it_ends_early_as_a_smaller_budget_would_also_when_resumed(short_recording, tmp_path):
    def calibrate(name, **how):
        run = tmp_path / name
        return bl.calibrate(short_recording, out=run, progress=False, **QUICK, **how)

    with pytest.raises(KeyboardInterrupt):
        calibrate("early", budget=40, until=goal(interrupted))
    early = calibrate("early", budget=40, until=ENOUGH, resume=True)
    plain = calibrate("plain", budget=SOONEST)
    np.testing.assert_array_equal(draws_of(early), draws_of(plain))
    assert early.summary.n_simulations == SOONEST
    assert early.summary.n_check_simulations == plain.summary.n_check_simulations
    assert early.record["settings"]["until"] == "intervals=0.25"
    assert "--until intervals=0.25" in early.run.again("calibrate")
    told = calibration_facts(early)["until"]
    assert (told["known"], told["most"]) == ("0.12", 40)
    assert calibration_facts(plain)["until"] is None
    whole = calibrate("early", budget=40, resume=True)
    assert whole.summary.n_simulations == 40 and "until" not in whole.record["settings"]


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        (["--until", "spill=1"], ["--until", "spill=1", "spillage=SHARE"]),
        (["--until", "spillage=-1"], ["--until", "spillage=-1", "above 0"]),
        (["--until", "spillage=1"], ["--until", "spillage=1", "below 1"]),
        (["--until", "spillage=abc"], ["--until", "abc", "spillage=SHARE"]),
        (["--until", "spillage=0,02"], ["--until", "0,02", "spillage=SHARE"]),
        (["--until", "intervals"], ["--until", "intervals=SDS"]),
        (["--until"], ["--until", "requires an argument"]),
        (["--until", "intervals=0.2", "--budget", "22"], ["--budget", "22", "more than 24"]),
        (["--cups", "cups.toml"], ["--cups", "--pours"]),
    ],
)
def test_what_cannot_end_a_search_is_refused_before_anything_is_made(
    short_recording, tmp_path, typed, told
):
    run = tmp_path / "run"
    result = CliRunner().invoke(app, ["calibrate", str(short_recording), "--out", str(run), *typed])
    assert result.exit_code == 2 and not run.exists()
    assert all(part in result.stderr for part in told)


@pytest.mark.parametrize(
    ("typed", "budget"),
    [
        ([], 20),
        (["--until", "intervals=0.2"], 60),
        (["--until", "intervals=0.2", "--budget", 30], 30),
    ],
)
def test_a_budget_that_is_not_typed_lets_the_search_end(
    short_recording, tmp_path, monkeypatch, typed, budget
):
    monkeypatch.setattr(calibrating, "_calibrate", lambda *_: None)
    command = ["calibrate", short_recording, "--out", tmp_path / "run", *typed]
    assert "not finished" in CliRunner().invoke(app, list(map(str, command))).stderr
    assert tomllib.loads((tmp_path / "run/run.toml").read_text())["settings"]["budget"] == budget


def test_a_text_is_no_goal_in_python(short_recording, tmp_path):
    with pytest.raises(InputError, match=r"^until: 'spillage=0.02'.*known"):
        bl.calibrate(short_recording, out=tmp_path / "run", until="spillage=0.02")  # pyright: ignore
