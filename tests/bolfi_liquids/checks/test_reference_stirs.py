"""What is refused of a reference's recordings, before anything is simulated."""

import pytest

from bolfi_liquids.checks.reference import open_reference
from bolfi_liquids.errors import InputError


def test_stirs_go_from_thin_to_thick_and_hidden_effects_are_left_out(grid):
    reference = open_reference(grid)
    assert [stir.name for stir in reference.stirs] == ["water_v10", "oil_v10", "gel_v10"]
    assert [stir.viscosity for stir in reference.stirs] == [0.001, 0.1, 12.0]
    assert {stir.fill for stir in reference.stirs} == {0.0503}
    assert reference.left_out == {"hidden_oil_delay_v10": "delay"}


def test_stirs_are_chosen_by_the_names_of_their_files(grid):
    reference = open_reference(grid)
    chosen = reference.chosen(["gel_v10.nc", "water_v10", "gel_v10"])
    assert [stir.name for stir in chosen] == ["water_v10", "gel_v10"]
    assert reference.chosen([]) == reference.stirs
    with pytest.raises(InputError, match="^names: no recording .*'couette'.*from water_v10"):
        reference.chosen(["couette"])
    with pytest.raises(InputError, match="'hidden_oil_delay_v10' holds the hidden effect delay"):
        reference.chosen(["hidden_oil_delay_v10"])


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
    "all hidden": (edited("0.0503,,", "0.0503,mass,0.2"), "every recording holds a hidden effect"),
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
