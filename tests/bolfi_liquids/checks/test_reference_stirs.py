"""What is refused of a reference's recordings, before anything is simulated."""

import numpy as np
import pytest

from bolfi_liquids.checks.reference import open_reference
from bolfi_liquids.errors import InputError


def test_stirs_go_from_thin_to_thick_and_hidden_effects_are_left_out(grid):
    reference = open_reference(grid)
    assert [stir.name for stir in reference.stirs] == ["water_v10", "oil_v10", "gel_v10"]
    assert [stir.viscosity for stir in reference.stirs] == [0.001, 0.1, 12.0]
    assert {stir.fill for stir in reference.stirs} == {0.0503}
    assert reference.left_out == {"hidden_oil_bubbles_v10": "bubbles"}


@pytest.mark.parametrize(
    ("hidden", "size", "effects"),
    [
        ("delay", "0.08", {"camera_delay": 0.08}),
        ("mass", "0.2", {"stick_mass": 1.2}),
        ("pivot", "3e-4", {"pivot_friction": 3e-4}),
        ("scale", "1.25", {"gripper_scale": 0.8}),
    ],
)
def test_a_hidden_effect_whose_size_is_known_acts_in_the_repetition(grid, hidden, size, effects):
    edited("0.0503,bubbles,0.08", f"0.0503,{hidden},{size}")(grid)
    reference = open_reference(grid)
    (stir,) = [one for one in reference.stirs if one.effects]
    assert stir.effects == pytest.approx(effects) and not reference.left_out


def test_a_liquid_that_warms_is_as_thin_at_the_end_as_the_table_says(grid):
    edited("0.1,0.0503,bubbles,0.08", "0.1,0.0503,warming,4")(grid)
    (stir,) = [one for one in open_reference(grid).stirs if one.effects]
    seconds = stir.recording.time[-1] - stir.recording.time[0]
    assert np.exp(stir.effects["warming"] * seconds) == pytest.approx(4.0)
    assert stir.thinnest == pytest.approx(0.025)


def test_stirs_are_chosen_by_the_names_of_their_files(grid):
    reference = open_reference(grid)
    chosen = reference.chosen(["gel_v10.nc", "water_v10", "gel_v10"])
    assert [stir.name for stir in chosen] == ["water_v10", "gel_v10"]
    assert reference.chosen([]) == reference.stirs
    with pytest.raises(InputError, match="^names: no recording .*'couette'.*from water_v10"):
        reference.chosen(["couette"])
    with pytest.raises(
        InputError, match="'hidden_oil_bubbles_v10' holds the hidden effect bubbles"
    ):
        reference.chosen(["hidden_oil_bubbles_v10"])


def edited(old, new):
    def edit(grid):
        table = grid / "truths.csv"
        assert old in table.read_text()
        table.write_text(table.read_text().replace(old, new))

    return edit


def repeated_row(grid):
    table = grid / "truths.csv"
    table.write_text(table.read_text() + "gel_v10.nc,gel,12,0.0503,,\n")


def broken(grid):
    (grid / "oil_v10.nc").write_bytes(b"no recording")


def renamed(grid):
    (grid / "oil_v10.nc").rename(grid / "Oil 10.nc")
    edited("oil_v10.nc,any,0.1,0.0503,,", "Oil 10.nc,any,0.1,0.0503,,")(grid)


GEL = "gel_v10.nc,any,12,0.0503"
FAULTS = {
    "no table": (
        lambda grid: (grid / "truths.csv").unlink(),
        "holds neither truths.csv.*a row for",
    ),
    "no recording": (lambda grid: (grid / "gel_v10.nc").unlink(), "4.*no recording 'gel_v10.nc'"),
    "no row": (edited(f"{GEL},,\n", ""), "truths.csv: no row for gel_v10.nc; add"),
    "two rows": (repeated_row, "line 6, column file: 'gel_v10.nc' is in line 4, too"),
    "a word": (edited("12,", "thick,"), "line 4, column viscosity_Pa_s: 'thick' is no number"),
    "no viscosity": (edited("12,", ","), "line 4, column viscosity_Pa_s: got ''; .*in Pa s"),
    "negative": (edited("12,", "-12,"), "viscosity_Pa_s: got '-12'; give a positive number"),
    "millimetres": (edited(GEL, "gel_v10.nc,any,12,50.3"), "true_fill_m: 50.3 m is not between"),
    "dry": (edited(GEL, "gel_v10.nc,any,12,0.01"), "0.01 m is not between the stick's tip"),
    "no column": (edited("viscosity_Pa_s", "eta"), "no column 'viscosity_Pa_s'.*give a column"),
    "no effects": (edited("hidden,size", "effect,size"), "no column 'hidden'.*give a column"),
    "damaged": (broken, "oil_v10.nc: not a NetCDF file"),
    "odd name": (renamed, "column file: 'Oil 10' cannot name results; rename"),
    "all hidden": (edited("0.0503,,", "0.0503,bubbles,1"), "every recording holds a hidden effect"),
    "no size": (edited("bubbles,0.08", "mass,"), "line 5, column size: got ''; give the size"),
    "no stick": (edited("bubbles,0.08", "mass,-1.5"), "line 5, column size: got '-1.5'"),
    "no warming": (edited("bubbles,0.08", "warming,0"), "line 5, column size: got '0'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named_with_file_field_value_and_cure(grid, fault):
    make, told = FAULTS[fault]
    make(grid)
    with pytest.raises(InputError, match=told) as refused:
        open_reference(grid)
    assert str(refused.value).startswith(str(grid))


def test_what_is_no_directory_is_refused(grid, tmp_path):
    with pytest.raises(InputError, match="no such directory"):
        open_reference(tmp_path / "none")
    with pytest.raises(InputError, match="a file, not a directory"):
        open_reference(grid / "truths.csv")
    with pytest.raises(InputError, match="^against: 3 is no path"):
        open_reference(3)
