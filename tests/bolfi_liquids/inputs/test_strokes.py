"""Strokes of a stir."""

from pathlib import Path

import numpy as np
from bolfi_liquids.hardware.motion import circle, star

from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.recording import Recording, Trajectory
from bolfi_liquids.inputs.strokes import (
    EVEN_PARTS,
    resting,
    speed,
    stroke_numbers,
    strokes,
)


def recorded(path) -> Recording:
    still = np.zeros((len(path.time), 2))
    return Recording(path.time, Trajectory(*path), still, {}, Path("stir.nc"), "hash")


def test_a_star_of_nine_points_has_its_strokes_and_a_rest_on_each_side():
    recording = recorded(star(speed=0.1, height=0.2, rest=1.0))
    found = strokes(recording)
    # one to the first vertex, nine from vertex to vertex
    assert [stroke.number for stroke in found] == list(range(12))
    assert np.sum([stroke.samples for stroke in found], axis=0).tolist() == [1] * len(
        recording.time
    )
    assert abs(recording.time[resting(recording)].max() - 1.0) < 0.1


def test_a_circle_has_no_strokes_and_is_cut_evenly():
    recording = recorded(circle(speed=0.1, height=0.2))
    assert [stroke.number for stroke in strokes(recording)] == list(range(1, EVEN_PARTS + 1))
    assert speed(recording).max() < 0.2


def test_numbers_of_samples_are_those_of_their_strokes():
    recording = bundled_recording("water")
    numbers = stroke_numbers(recording)
    assert (np.diff(numbers) >= 0).all()
    for stroke in strokes(recording):
        assert (numbers[stroke.samples] == stroke.number).all()
