"""Messages that troubleshooting.md quotes are those that people get."""

import errno
import json
import re
import shutil
import sys
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray
from bolfi_liquids.hardware.vision.opencv import opencv
from typer.testing import CliRunner

from bolfi_liquids.cli.app import app
from bolfi_liquids.guide import read_page
from bolfi_liquids.run.run import Run

HEADING = re.compile(r"^### (`+) ?(?P<message>.*?) ?\1$", re.MULTILINE)
QUOTED = [match["message"] for match in HEADING.finditer(read_page("troubleshooting"))]


def shifted(name, offset):
    return lambda stir: stir.assign({name: stir[name] + offset})


def unseen(name, start, stop):
    def without(stir):
        stir[name][start:stop] = np.nan
        return stir

    return without


def in_degrees(stir):
    attributes = stir["inclination_xz"].attrs
    return stir.assign(inclination_xz=np.degrees(stir["inclination_xz"]).assign_attrs(attributes))


def in_millimetres(stir):
    stir["x"].attrs["units"] = "mm"
    return stir


def in_milliseconds(stir):
    attributes = stir["time"].attrs
    return stir.assign_coords(time=(1000.0 * stir["time"]).assign_attrs(attributes))


def without_inclination(stir):
    stir["inclination_xz"][:] = 0.0
    return stir


def without_density(stir):
    del stir.attrs["liquid_density"]
    return stir


SPOILED = {
    "x: missing": lambda stir: stir.rename(x="px"),
    "attribute liquid_density: missing": without_density,
    "largest inclination = 7.30548 rad": in_degrees,
    "has units 'mm'": in_millimetres,
    "usual step = 33.3333 s": in_milliseconds,
    "shortest step": lambda stir: stir.isel(time=slice(None, None, -1)),
    "without an inclination = 1.03333 s": unseen("inclination_yz", 40, 70),
    "NaN in 181 of 201": unseen("inclination_yz", 20, None),
    "without a position": unseen("x", 40, 60),
    "of one number while the gripper moves": without_inclination,
    "starts in motion": lambda stir: stir.isel(time=slice(40, None)),
    "room between stick and wall": shifted("x", 0.05),
    "height of the tip": shifted("z", -0.05),
    "floats up": lambda stir: stir.assign_attrs(stick_density=300.0),
    "part = 1.06667 of cup_height": lambda stir: stir.assign_attrs(fill=0.08),
}


@pytest.fixture
def told(tmp_path, monkeypatch):
    """Runs a command where a recording stir.nc lies; what it says last."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "stir.nc").write_bytes(
        (files("bolfi_liquids.data") / "glycerin_v10.nc").read_bytes()
    )

    def run(command):
        result = CliRunner().invoke(app, command.split())
        return (result.stderr.strip().splitlines() or [""])[-1]

    return run


@pytest.fixture
def run(calibration, told, tmp_path):
    """A copy of a calibrated run, runs/mine."""
    return shutil.copytree(calibration.path, tmp_path / "runs" / "mine")


def test_refused_recordings(told, tmp_path):
    whole, said = xarray.load_dataset(tmp_path / "stir.nc", decode_times=False), {}
    for part, spoil in SPOILED.items():
        spoil(whole.copy(deep=True)).to_netcdf(tmp_path / "stir.nc")
        said[part] = told("calibrate stir.nc --out runs/mine")
    assert not {part: line for part, line in said.items() if part not in line or line not in QUOTED}


def test_refused_commands(told, tmp_path):
    bundled = (files("bolfi_liquids.hardware.data") / "rig.toml").read_text(encoding="utf-8")
    for name, old, new in (
        ("video.toml", r"^source = .*$", 'source = "video.avi"'),
        ("slow.toml", r"^speed = 0.15", "speed = 0.05"),
        ("moved.toml", r"position = \[0.3,", "position = [0.4,"),
    ):
        text = re.sub(old, new, bundled, flags=re.MULTILINE)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "runs" / "stir").mkdir(parents=True)
    (tmp_path / "runs" / "stir" / "rig.json").touch()
    commands = [
        "calibrate stir.nc",
        "calibrat",
        "calibrate stir.nc stir.nc --out runs/mine",
        "calibrate stir.nc --particles 10 --out runs/mine",
        "record --arm --out runs/new --rig video.toml",
        "record --rig slow.toml",
        "record --out runs/stir",
        "record --rig moved.toml",
    ]
    said = {typed: re.sub("slow.toml|moved.toml", "rig.toml", told(typed)) for typed in commands}
    assert not {typed: line for typed, line in said.items() if line not in QUOTED}


def test_directories_that_cannot_be_worked_in(told, tmp_path):
    from bolfi_liquids.run.run import alone_in

    assert told("calibrate stir.nc --out=") in QUOTED
    (tmp_path / "runs" / "mine").mkdir(parents=True)
    (tmp_path / "runs" / "mine" / "run.toml").touch()
    assert told("calibrate stir.nc --out runs/mien --resume") in QUOTED
    with alone_in(tmp_path / "runs" / "mine"):
        assert told("criticise runs/mine") in QUOTED


def test_a_full_disk():
    from bolfi_liquids.cli.errors import explained

    full = OSError(errno.ENOSPC, "", "runs/mine/simulations.sqlite")
    assert f"error: {explained(full)}" in QUOTED


def test_missing_and_damaged_files(told, tmp_path):
    (tmp_path / "stir.nc").write_text("time,x\n", encoding="utf-8")
    assert told("calibrate stir.nc --out runs/mine") in QUOTED
    (tmp_path / "stir.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(99))
    assert told("calibrate stir.nc --out runs/mine") in QUOTED
    (tmp_path / "stir.nc").unlink()
    assert told("calibrate stir.nc --out runs/mine") in QUOTED


def test_wrong_maps_of_a_table(told, tmp_path):
    (tmp_path / "stir.csv").write_text("t,tcp_x,tcp_y,tcp_z,angle_xz,angle_yz\n", encoding="utf-8")
    assert told("import --template columns.toml") == ""
    assert told("import --template columns.toml") in QUOTED
    path = tmp_path / "columns.toml"
    template = path.read_text(encoding="utf-8")
    for right, wrong in (
        ('"tcp_x"', '"tool_x"'),
        ('"tcp_x", unit = "mm"', '"tcp_x", unit = "inch"'),
    ):
        path.write_text(template.replace(right, wrong), encoding="utf-8")
        assert told("import stir.csv --columns columns.toml") in QUOTED


def test_odd_numerals_of_a_table(told, tmp_path):
    header = "t;tcp_x;tcp_y;tcp_z;angle_xz;angle_yz\n"
    (tmp_path / "stir.csv").write_text(f"{header}0;1;1;1;0;0\n1;1,234.5;1;1;0;0\n")
    told("import --template columns.toml")
    assert told("import stir.csv --columns columns.toml") in QUOTED


def test_pours_far_from_their_cups(told, run, tmp_path):
    rows = ["60,1,1,9,0", "60,2,1,9,0", "60,50,1,9,0"]
    header = "angular_velocity_deg_s,distance_cm,spilled,received,retained"
    (tmp_path / "pours.csv").write_text("\n".join([header, *rows, ""]))
    assert told("criticise runs/mine --pours pours.csv") in QUOTED


def test_runs_that_cannot_go_on(told, run, calibration):
    assert told("calibrate stir.nc --out runs/mine") in QUOTED
    options = "--budget 7 --batch 2 --seed 3 --particles 200 --resume"
    assert told(f"calibrate stir.nc --out runs/mine {options}") in QUOTED
    whole = (run / "run.toml").read_text(encoding="utf-8")
    former = re.sub(r'^model = "\d+"', 'model = "7"', whole, flags=re.M)
    (run / "run.toml").write_text(former, encoding="utf-8")
    said = told("report runs/mine").replace("1-short.nc", "1-stir.nc")
    assert re.sub(r"(model_|this is )\d+", r"\g<1>8", said) in QUOTED
    (run / "run.toml").write_text(whole, encoding="utf-8")
    (run / "posterior.nc").write_bytes(b"cut off")
    assert told("report runs/mine").replace("1-short.nc", "1-stir.nc") in QUOTED
    (run / "posterior.nc").unlink()
    assert told("report runs/mine").replace("1-short.nc", "1-stir.nc") in QUOTED
    (run / "run.toml").unlink()
    assert told("report runs/mine").replace("1-short.nc", "1-stir.nc") in QUOTED
    shutil.rmtree(run / "recordings")
    assert told("report runs/mine") in QUOTED
    assert told("calibrate stir.nc --out runs/mine") in QUOTED


def test_a_run_without_a_pour_executes_none(told, run):
    (run / "pour.nc").unlink(missing_ok=True)
    assert told("pour runs/mine --execute") in QUOTED


def test_pours_that_may_not_be_executed(told, poured_run, tmp_path):
    run = shutil.move(poured_run, tmp_path / "runs" / "mine")
    opened = Run.open(run)
    tree = opened.required("pour")
    opened.keep("pour", tree, {"after": "another", "given": ""}, json.loads(tree.attrs["summary"]))
    assert told("pour runs/mine --execute") in QUOTED


def test_criticism_without_proof_or_with_none(told, run, criticism_summary):
    from bolfi_liquids.reporting.facts import verdict_facts
    from bolfi_liquids.reporting.prose import prose

    copy = next((run / "recordings").iterdir())
    shutil.copy(copy, "stir.nc")
    assert told("criticise runs/mine --held-out stir.nc") in QUOTED
    (no_baseline,) = prose("baseline", {"criticism": {"baseline": 0, "baseline_left_out": ()}})
    assert no_baseline in QUOTED
    facts = verdict_facts(replace(criticism_summary, held_out=0))
    (unconfirmed,) = prose("verdict", {"criticism": facts})
    assert any(unconfirmed.endswith(message) for message in QUOTED)


def test_cups_in_millimetres(told, run, tmp_path):
    good = (files("bolfi_liquids.data") / "cups.toml").read_text(encoding="utf-8")
    (tmp_path / "cups.toml").write_text(
        good.replace("radius = 0.028", "radius = 28.0"), encoding="utf-8"
    )
    assert told("pour runs/mine --cups cups.toml") in QUOTED


def test_missing_extra(told, monkeypatch):
    opencv.cache_clear()  # an earlier test of this process may have imported it
    monkeypatch.setitem(sys.modules, "cv2", None)
    assert told("rig calibrate-cameras --print-board board.png") in QUOTED


def test_warnings_of_the_engine(calibration):
    from bolfi_liquids.inference.surrogates.warnings import OUTSIDE

    from bolfi_liquids.reporting.facts import fit_facts
    from bolfi_liquids.reporting.prose import prose

    assert f"EmulatorWarning: {OUTSIDE}" in QUOTED
    summary = replace(
        calibration.summary,
        rhat_max=1.024,
        ess_min=80.0,
        divergences=0,
        n_draws=80,
        below_least_viscosity=0.34,
        least_viscosity=0.0494,
    )
    latest = fit_facts(summary) | {"bad": None}
    search = {"doubts": (), "few_searched": False, "misfit": False, "untested": None}
    facts = {"latest": latest, "calibration": search, "criticism": None, "pour": None}
    unconverged, _, thin = prose("warnings", facts | {"outdated": ()})
    assert unconverged in QUOTED
    assert any(thin.startswith(message) for message in QUOTED)


def test_warnings_of_stirs_that_are_cut_too_roughly():
    from bolfi_liquids.models.faults import DRIFTED, FailedSimulation, faulty
    from bolfi_liquids.models.numerics import UntestedResolution, check_resolution

    with pytest.warns(UntestedResolution) as warned:
        check_resolution(0.002, 0.004)
    with pytest.warns(FailedSimulation) as failed:
        faulty(np.array([DRIFTED]), np.array([0]))
    for warning in (*warned, *failed):
        assert f"{warning.category.__name__}: {warning.message}" in QUOTED


def test_warnings_of_a_wrong_frame_and_of_a_bad_fit(calibration):
    from bolfi_liquids.calibration.summary import bad_fit
    from bolfi_liquids.inputs.bundled import bundled_recording
    from bolfi_liquids.inputs.frame import recording_warnings

    recording = bundled_recording("glycerin")
    xz, yz = recording.inclination.T
    turned = replace(
        recording,
        path=Path("stir.nc"),
        inclination=np.column_stack([xz - yz, xz + yz]) / np.sqrt(2.0),
    )
    (warning,) = recording_warnings([turned])
    assert warning in QUOTED
    far = replace(calibration.summary, fit_rms_deg=2.1, noise_deg=0.24)
    assert str(bad_fit(far)) in QUOTED


def test_sentences_that_the_page_on_priors_quotes(calibration):
    from bolfi_liquids.inference.surrogates.warnings import OUTSIDE

    from bolfi_liquids.reporting.facts import calibration_facts
    from bolfi_liquids.reporting.prose import prose

    facts = calibration_facts(calibration)
    for one in facts["parameters"]:
        one |= {"learned": True, "at_end": True}
    said = [prose("liquid", {"calibration": facts})[0], OUTSIDE]
    page = " ".join(read_page("priors").split())
    quoted = [one for one in re.findall(r'"([^"]*)"', page) if len(one.split()) > 6]
    assert len(quoted) == len(said)
    for text, quote in zip(said, quoted, strict=True):
        assert quote in text


def test_there_are_causes_and_cures():
    page = read_page("troubleshooting")
    assert len(QUOTED) >= 20
    for before, after in zip(QUOTED, [*QUOTED[1:], None], strict=True):
        rest = page.split(before, 1)[1]
        entry = rest if after is None else rest.split(after, 1)[0]
        assert len(re.sub(r"[`#\s]", "", entry)) > 5, before
