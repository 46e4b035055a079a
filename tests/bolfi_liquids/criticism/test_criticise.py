"""What a criticism is given: read, checked and written down."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.criticism.verdict_kind import VerdictKind

import bolfi_liquids as bl
from bolfi_liquids.cli.printed import print_findings
from bolfi_liquids.criticism.inputs import open_inputs
from bolfi_liquids.criticism.summary import SourceVerdict, _together
from bolfi_liquids.errors import Argument, InputError
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.open import open_recordings
from bolfi_liquids.inputs.settings import CriticismSettings

HEADER = "angular_velocity_deg_s,distance_cm,spilled,received,retained"
ROWS = ["45,1,5,90,5", "90,2,10,85,5", "60,3,20,75,5"]


@pytest.fixture(scope="module")
def files(calibration, tmp_path_factory):
    """Paths of what a criticism may be given, by a short name."""
    tmp_path = tmp_path_factory.mktemp("given")
    dataset = xr.load_dataset(bundled_recording("glycerin").path, decode_times=False)

    def table(rows):
        return "\n".join([HEADER, *rows]) + "\n"

    stirs = {
        "held": {},
        "clean": {},
        "wide": {"cup_radius": 0.05},
        "dense": {"liquid_density": 9e2},
    }
    for name, attrs in stirs.items():
        dataset.assign_attrs(attrs, note=name).to_netcdf(tmp_path / f"{name}.nc")
    dataset.isel(time=slice(0, None, 2)).to_netcdf(tmp_path / "slow.nc")
    (tmp_path / "b").mkdir()
    dataset.assign_attrs(note="b").to_netcdf(tmp_path / "b" / "held.nc")
    pours = {"pours": ROWS, "others": ROWS[::-1], "far": [*ROWS, "60,50,33,33,34"]}
    for name, rows in pours.items():
        (tmp_path / f"{name}.csv").write_text(table(rows))
    (own,) = calibration.run.recordings
    made = {path.stem: path for path in (*tmp_path.glob("*.nc"), *tmp_path.glob("*.csv"))}
    return made | {"fitted": own.path, "namesake": tmp_path / "b" / "held.nc"}


@pytest.fixture
def given(calibration, files):
    """(option=short names) -> the inputs of a criticism."""

    def opened(settings=None, cups=None, **names):
        def paths(option):
            return [files[name] for name in names.get(option, "").split()]

        recordings = [
            open_recordings(paths(option), Argument(option)) for option in ("held_out", "baseline")
        ]
        poured = [next(iter(paths(option)), None) for option in ("pours", "held_out_pours")]
        return open_inputs(calibration, settings or CriticismSettings(), *recordings, poured, cups)

    return opened


def test_what_a_result_was_made_from_names_every_file(given):
    cups = bundled_cups()
    higher = cups.model_copy(update={"pour": cups.pour.model_copy(update={"lip_height": 0.21})})
    inputs = given(baseline="clean", held_out="held", pours="pours", cups=higher)
    made_from = inputs.made_from
    for group, name in {"baseline": "clean", "held_out": "held"}.items():
        assert list(made_from[group].values()) == [f"{name}.nc"]
    assert list(made_from["pours"].values()) == ["pours.csv"]
    assert made_from["settings"]["seed"] == 0
    assert made_from["poured"]["cups"]["pour"]["lip_height"] == 0.21 != cups.pour.lip_height
    assert inputs.level == 0.025  # of each of two sources


def test_other_settings_or_files_are_another_question(given):
    asked = [
        given(),
        given(CriticismSettings(seed=1)),
        given(baseline="clean"),
        given(held_out="clean"),
        given(pours="pours"),
        given(pours="pours", held_out_pours="others"),
    ]
    made_from = [inputs.made_from for inputs in asked]
    assert all(one != two for i, one in enumerate(made_from) for two in made_from[:i])
    assert made_from[0] == given().made_from


def test_two_files_of_one_name_are_two(given):
    both = given(baseline="held namesake").made_from
    assert list(both["baseline"].values()) == ["held.nc", "held.nc"]
    assert both not in [given(baseline=name).made_from for name in ("held", "namesake")]


@pytest.mark.parametrize(
    ("stirs", "pours", "expected"),
    [
        (("none", 0.9), ("none", 0.8), ("none", (), 0.72)),
        (("effect", 0.9, "stick_mass"), ("none", 0.8), ("effect", ("stick_mass",), 0.9)),
        (("tie", 0.9, "a", "b"), ("unknown", 0.8), ("tie", ("a", "b"), 0.9)),
        (("effect", 0.9, "a"), ("effect", 0.5, "b"), ("effect", ("a", "b"), 0.45)),
    ],
)
def test_sources_that_agree_are_all_right_with_the_product_of_their_probabilities(
    stirs, pours, expected
):
    given = [
        SourceVerdict(VerdictKind(verdict), tuple(effects), {}, 0.5, probability, {}, {}, (), 0)
        for verdict, probability, *effects in (stirs, pours)
    ]
    found = _together(given)
    assert (found["verdict"], found["effects"]) == expected[:2]
    assert found["probability"] == pytest.approx(expected[2])


def test_a_clean_recording_that_is_criticised_or_held_out_is_no_baseline(given):
    inputs = given(held_out="held", baseline="fitted held clean")
    assert [recording.path.name for recording in inputs.baseline] == ["clean.nc"]
    assert [name.removeprefix("1-") for name in inputs.left_out] == ["short.nc", "held.nc"]
    assert inputs.made_from != given(held_out="held", baseline="clean").made_from


def test_one_recording_that_was_opened_is_not_held_out_twice(calibration, given):
    (one,) = given(held_out="held").held_out
    with pytest.raises(InputError, match="held_out"):
        open_inputs(calibration, CriticismSettings(), [one, one], [])


@pytest.mark.parametrize(
    ("names", "where"),
    [
        ({"held_out": "held namesake"}, "held_out"),
        ({"held_out": "fitted"}, "held_out"),
        ({"held_out": "wide"}, "held_out"),
        ({"held_out": "dense"}, "held_out"),
        ({"baseline": "slow"}, "baseline"),
        ({"held_out_pours": "others"}, "held_out_pours"),
        ({"pours": "pours", "held_out_pours": "pours"}, "held_out_pours"),
        ({"pours": "pours", "held_out_pours": "far"}, "far.csv"),
        ({"pours": "pours", "cups": 3}, "cups"),
    ],
)
def test_what_cannot_be_used_is_refused_by_its_name(given, names, where):
    with pytest.raises(InputError) as refused:
        given(**names)
    assert where in refused.value.where


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"effects": "magic"}, "effects"),
        ({"effects": "adhesion"}, "effects"),
        ({"effects": "camera_delay", "accept": "camera_tilt"}, "accept"),
    ],
)
def test_effects_are_refused_before_the_run_is_looked_at(tmp_path, options, where):
    with pytest.raises(InputError) as refused:
        bl.criticise(tmp_path, **options)
    assert where in refused.value.where


@pytest.mark.slow
def test_an_effect_of_pours_alone_is_looked_for_there_and_stirs_are_tested(
    calibration, pour_settings, tmp_path
):
    run, table = tmp_path / "run", tmp_path / "pours.csv"
    shutil.copytree(calibration.path, run)
    table.write_text("\n".join([HEADER, "90,1,5,90,5", "90,2,9,86,5", "90,3,20,75,5"]))
    found = bl.criticise(
        run, effects="adhesion", pours=table, cups=pour_settings["cups"], progress=False
    )
    of_stirs, of_pours = (found.tree[f"{name}/effects"] for name in ("stirs", "pours"))
    assert not of_stirs.sizes["effect"] and list(of_pours["effect"].values) == ["adhesion"]
    assert found.summary.stirs.verdict in ("none", "unknown") and not found.summary.stirs.effects
    assert bl.Criticism.open(run).verdict == found.verdict
    print_findings(found)
    assert "adhesion" in bl.report(run, moving=False, progress=False).read_text(encoding="utf-8")


def test_what_is_held_out_or_clean_in_a_wrong_frame_is_told(calibration, caplog):
    right = bundled_recording("glycerin")
    xz, yz = right.inclination.T
    turned, mirrored = ([xz - yz, xz + yz] / np.sqrt(2.0)).T, np.column_stack([xz, -yz])
    for option, wrong in (("held_out", turned), ("baseline", mirrored)):
        for seen, count in ((wrong, 1), (right.inclination, 0)):
            caplog.clear()
            one = replace(right, path=Path("other.nc"), hash="a", inclination=seen)
            # the limit of time is looked at last, before anything is simulated
            with pytest.raises(InputError, match="timeout"):
                bl.criticise(calibration, progress=False, timeout=-1.0, **{option: one})
            notices = [record.getMessage() for record in caplog.records]
            assert len(notices) == count and all(text.startswith("other.nc: ") for text in notices)
