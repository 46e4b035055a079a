"""Scenes of the validation cases stop when their time is over, and can be used afterwards."""

import numpy as np
import pytest
from bolfi_liquids.models import runtime
from bolfi_liquids.models.validation.scenes.held_stick import slip_forces
from bolfi_liquids.models.validation.scenes.still_cup import Flow, StillCup, flow_in_cup
from bolfi_liquids.models.validation.scenes.wet_box import Body, WetBox, WetLiquid, flow_in_box

CUP = StillCup(radius=0.02, depth=0.02)


def in_a_cup():
    flow_in_cup(CUP, np.ones(1), Flow(), 0.05, lambda position, velocity: 0.0)


def along_a_stick():
    slip_forces(CUP, 0.0045, np.ones(1), lambda time: np.zeros((1, len(time))), 0.05)


def in_a_box():
    box = WetBox(size=(0.02, 0.004, 0.02))
    body = Body(np.array([[0.01, 0.002, 0.004]]), 1e-8)
    flow_in_box(box, [WetLiquid(1.0)], [body], 0.03, lambda position, velocity: 0.0)


# each compiles a scene of its own; that of the box serves other tests, too
@pytest.mark.parametrize(
    "simulate",
    [*(pytest.param(one, marks=pytest.mark.slow) for one in (in_a_cup, along_a_stick)), in_a_box],
)
def test_the_time_of_a_scene_is_limited(simulate):
    with pytest.raises(runtime.TimeLimitExceeded, match="stopped after 0 of"):
        with runtime.time_limit(0.0):
            simulate()
    simulate()
