"""A run is never overwritten, and only resumed with the settings it was started with."""

import copy
import json

import numpy as np
import pytest
from bolfi_liquids.inference.simulations.bank import Simulation

from bolfi_liquids.errors import InputError
from bolfi_liquids.files import write_whole
from bolfi_liquids.run import directory
from bolfi_liquids.run.directory import (
    CONCLUSIONS,
    RUN_TOML,
    SIMULATIONS,
    enter_run,
    note_timeout,
    open_bank,
    read_run,
)
from bolfi_liquids.run.summary import read_summary, write_section

RECORD = {
    "created": "2026-01-01T00:00:00+00:00",
    "settings": {"budget": 20, "seed": 0, "prior": {"viscosity": "LogUniform(0.001, 20)"}},
    "simulator": {"recording_1": {"particles": 1000, "cup": {"radius": 0.04}}},
    "inputs": {"sha256": ["ab"]},
    "versions": {"numpy": "2.0"},
}


def test_a_run_is_not_overwritten(tmp_path):
    run = tmp_path / "a" / "run"
    enter_run(run, RECORD, resume=False)
    before = (run / RUN_TOML).read_bytes()
    with pytest.raises(InputError, match="holds a run already.*`resume`"):
        enter_run(run, RECORD, resume=False)
    assert (run / RUN_TOML).read_bytes() == before


@pytest.mark.parametrize(
    ("section", "field", "value"),
    [
        ("settings", "seed", 1),
        ("settings", "prior", {"viscosity": "Uniform(0, 1)"}),
        ("simulator", "recording_1", {"particles": 500, "cup": {"radius": 0.04}}),
        ("simulator", "recording_2", {"particles": 1000}),
    ],
)
def test_resuming_with_another_setting_names_it(tmp_path, section, field, value):
    enter_run(tmp_path, RECORD, resume=False)
    other = copy.deepcopy(RECORD)
    other[section][field] = value
    with pytest.raises(InputError, match=rf"{section}\.{field}"):
        enter_run(tmp_path, other, resume=True)
    assert read_run(tmp_path) == RECORD


def test_resuming_with_another_recording_is_said(tmp_path):
    enter_run(tmp_path, RECORD, resume=False)
    other = copy.deepcopy(RECORD)
    other["inputs"]["sha256"] = ["cd"]
    with pytest.raises(InputError, match="is of other recordings; give those that run.toml names"):
        enter_run(tmp_path, other, resume=True)


def test_a_run_grows_in_the_field_that_may_grow(tmp_path):
    enter_run(tmp_path, RECORD, resume=False)
    write_section(tmp_path, "calibrate", {"seed": 0})
    larger = copy.deepcopy(RECORD)
    larger["settings"]["budget"] = 30
    with pytest.raises(InputError, match=r"settings\.budget is 20 in the run, but 30"):
        enter_run(tmp_path, larger, resume=True)
    with pytest.raises(InputError, match="holds a run already"):
        enter_run(tmp_path, larger, resume=False, growing="settings.budget")
    assert read_summary(tmp_path)
    removed = enter_run(tmp_path, larger, resume=True, growing="settings.budget")
    assert removed == ["summary.json"]
    grown = read_run(tmp_path)
    assert grown["settings"] == larger["settings"]
    assert grown["created"] == RECORD["created"]
    assert not read_summary(tmp_path)  # what fewer simulations had taught

    other = copy.deepcopy(larger)
    other["settings"] |= {"budget": 40, "seed": 1}
    with pytest.raises(InputError, match=r"settings\.seed.*own value, or choose"):
        enter_run(tmp_path, other, resume=True, growing="settings.budget")
    with pytest.raises(InputError, match=r"settings\.budget is 30.*own value or a larger one"):
        enter_run(tmp_path, RECORD, resume=True, growing="settings.budget")


def test_a_run_that_is_killed_while_it_grows_is_an_unfinished_one(tmp_path, monkeypatch):
    enter_run(tmp_path, RECORD, resume=False)
    for name in CONCLUSIONS:
        (tmp_path / name).write_text("{}")
    larger = copy.deepcopy(RECORD)
    larger["settings"]["budget"] = 30

    def die(path, text):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(directory, "write_text", die)
        enter_run(tmp_path, larger, resume=True, growing="settings.budget")
    assert read_run(tmp_path) == RECORD
    assert not any((tmp_path / name).exists() for name in CONCLUSIONS)
    enter_run(tmp_path, larger, resume=True, growing="settings.budget")
    assert read_run(tmp_path)["settings"]["budget"] == 30


def test_a_run_that_grows_twice_counts_what_it_had_learned_from(tmp_path):
    enter_run(tmp_path, RECORD, resume=False)
    for budget, simulations in ((40, 32), (60, 37)):  # 20 and 12 to judge them; 5 of 20 more
        larger = copy.deepcopy(RECORD)
        larger["settings"]["budget"] = budget
        with open_bank(tmp_path) as bank:
            for seed in range(len(bank), simulations):
                bank.put("stir", {}, seed, Simulation(np.zeros(1), None, 1.0))
        enter_run(tmp_path, larger, resume=True, growing="settings.budget")
    grown = read_run(tmp_path)["grown"]
    assert [(one["size"], one["learned_from"]) for one in grown] == [(20, 20), (40, 25)]


def test_time_limits_are_listed_and_need_not_agree(tmp_path):
    enter_run(tmp_path, RECORD, resume=False)
    for timeout in (None, 60.0, 5, 60.0):
        note_timeout(tmp_path, timeout)
    assert read_run(tmp_path) == RECORD | {"timeouts": [60.0, 5.0]}
    assert not enter_run(tmp_path, RECORD, resume=True)
    larger = copy.deepcopy(RECORD)
    larger["settings"]["budget"] = 30
    enter_run(tmp_path, larger, resume=True, growing="settings.budget")
    assert read_run(tmp_path)["timeouts"] == [60.0, 5.0]


def test_resuming_ignores_dates_and_versions(tmp_path):
    enter_run(tmp_path, RECORD, resume=False)
    later = RECORD | {"created": "2027-01-01T00:00:00+00:00", "versions": {"numpy": "3.0"}}
    assert not enter_run(tmp_path, later, resume=True)
    assert read_run(tmp_path) == RECORD


def test_resuming_nothing_starts_a_run(tmp_path):
    enter_run(tmp_path, RECORD, resume=True)
    assert read_run(tmp_path) == RECORD


@pytest.mark.parametrize("name", [SIMULATIONS, *CONCLUSIONS])
def test_results_without_settings_are_left_alone(tmp_path, name):
    (tmp_path / name).write_bytes(b"precious")
    with pytest.raises(InputError, match=f"holds {name} without run.toml"):
        enter_run(tmp_path, RECORD, resume=True)
    assert (tmp_path / name).read_bytes() == b"precious"


def test_a_section_is_replaced_and_the_others_kept(tmp_path):
    write_section(tmp_path, "calibrate", {"seed": 1, "rhat_max": float("nan")})
    write_section(tmp_path, "pour", {"distance_cm": 2.0})
    write_section(tmp_path, "calibrate", {"seed": 2})
    assert read_summary(tmp_path) == {"calibrate": {"seed": 2}, "pour": {"distance_cm": 2.0}}
    assert [p.name for p in tmp_path.iterdir()] == ["summary.json"]


def test_what_is_not_a_number_becomes_null(tmp_path):
    write_section(tmp_path, "calibrate", {"rhat_max": float("nan"), "deep": [float("inf"), 1.0]})
    text = (tmp_path / "summary.json").read_text()
    assert json.loads(text)["calibrate"] == {"rhat_max": None, "deep": [None, 1.0]}


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "summary.json"
    path.write_text("old")

    def fail(temporary):
        temporary.write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_whole(path, fail)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["summary.json"]


def test_broken_summary_is_named(tmp_path):
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(InputError, match="not JSON"):
        write_section(tmp_path, "pour", {})


@pytest.mark.parametrize(
    "content",
    [b'{"pour": {"a": NaN}}', b'{"pour": {"a": 1e999}}', b'{"pour": {"a": "\xe9"}}', b"[" * 9999],
)
def test_numbers_and_bytes_that_json_does_not_know_are_refused_by_file(tmp_path, content):
    path = tmp_path / "summary.json"
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        write_section(tmp_path, "calibrate", {})
    assert refused.value.where == str(path)
    assert path.read_bytes() == content


def test_a_record_that_is_no_text_is_named(tmp_path):
    (tmp_path / "run.toml").write_bytes(b'created = "\xe9"')
    with pytest.raises(InputError, match="run.toml: not TOML"):
        read_run(tmp_path)
