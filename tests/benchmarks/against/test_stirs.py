"""What is read of a reference's recordings, and what is refused."""

import numpy as np
import pytest

from .stirs import open_reference_stirs


def test_stirs_go_from_thin_to_thick_and_hidden_effects_are_left_out(grid):
    stirs, left_out = open_reference_stirs(grid)
    assert [stir.name for stir in stirs] == ["water_v10", "oil_v10", "gel_v10"]
    assert [stir.viscosity for stir in stirs] == [0.001, 0.1, 12.0]
    assert {stir.fill for stir in stirs} == {0.0503}
    assert left_out == {"hidden_oil_bubbles_v10": "bubbles"}


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
    edit(grid, "0.0503,bubbles,0.08", f"0.0503,{hidden},{size}")
    stirs, left_out = open_reference_stirs(grid)
    (stir,) = [one for one in stirs if one.effects]
    assert stir.effects == pytest.approx(effects) and not left_out


def test_an_effect_without_a_size_is_left_out(grid):
    edit(grid, "bubbles,0.08", "mass,")
    assert open_reference_stirs(grid).left_out == {"hidden_oil_bubbles_v10": "mass"}


def test_a_liquid_that_warms_is_as_thin_at_the_end_as_the_table_says(grid):
    edit(grid, "0.1,0.0503,bubbles,0.08", "0.1,0.0503,warming,4")
    (stir,) = [one for one in open_reference_stirs(grid).stirs if one.effects]
    seconds = stir.recording.time[-1] - stir.recording.time[0]
    assert np.exp(stir.effects["warming"] * seconds) == pytest.approx(4.0)
    assert stir.thinnest == pytest.approx(0.025)


def edit(folder, old, new):
    table = folder / "truths.csv"
    assert old in table.read_text()
    table.write_text(table.read_text().replace(old, new))
