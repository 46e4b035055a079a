"""Scenes of the validation cases stop when their time is over, and can be used afterwards."""

import numpy as np
import pytest
from bolfi_liquids.models.fluid import runtime
from bolfi_liquids.models.validation.scenes.held_stick import slip_forces
from bolfi_liquids.models.validation.scenes.still_cup import Flow, StillCup, flow_in_cup

from bolfi_liquids import models

CUP = StillCup(radius=0.02, depth=0.02)


def in_a_cup():
    flow_in_cup(CUP, np.ones(1), Flow(), 0.05, lambda position, velocity: 0.0)


def along_a_stick():
    slip_forces(CUP, 0.0045, np.ones(1), lambda time: np.zeros((1, len(time))), 0.05)


def in_a_box():
    from bolfi_liquids.models.validation.scenes.box import Box, box_scene, lattice

    size = (0.07, 0.07, 0.07)
    with runtime.LOCK:
        scene = box_scene(Box(size, 0.01, 343), 1)
        scene.place([lattice((7, 7, 7), size, 0)])
        scene.drive()
        scene.pour_in(models.Liquid(1.0, 0.0, 1000.0).batch(1))
        scene.advance(1, 2)


@pytest.mark.parametrize(
    "simulate", [in_a_cup, pytest.param(along_a_stick, marks=pytest.mark.slow), in_a_box]
)
def test_the_time_of_a_scene_is_limited(simulate):
    with pytest.raises(runtime.TimeLimitExceeded, match="stopped after 0 of"):
        with runtime.time_limit(0.0):
            simulate()
    if simulate is not in_a_box:
        simulate()
