import numpy as np
import pytest
from bolfi_liquids.hardware import bundled_rig, emulated, servoed
from bolfi_liquids.hardware.motion import stir
from bolfi_liquids.hardware.motion.poses import cup_frame
from stepped_clock import SteppedClock

RIG = bundled_rig()


@pytest.mark.parametrize(("kind", "rate"), [("cb3", 125.0), ("e-series", 500.0)])
def test_the_arm_that_is_servoed_along_a_stir_is_where_it_was_reckoned(kind, rate):
    robot = RIG.robot.model_copy(update={"controller": kind, "rate": rate})
    rig, frame = RIG.model_copy(update={"robot": robot}), cup_frame(RIG.cup)
    path = stir(rig)
    controller = emulated(rig, path.pose[0]).controller
    clock = SteppedClock(controller.begun)
    arm = controller._replace(clock=clock).follower(rig, "stirring")
    arm.connect()
    arm.take_control()
    way = []
    for pose in frame.to_base(path.pose):
        arm.command(pose)
        clock.sleep(1.0 / rate)
        way.append(arm.read().pose)
    found = frame.from_base(np.array(way))[:, :3]
    off = np.linalg.norm(found - servoed(path).position, axis=1)
    assert off.max() < 1e-4
    # against a path that was not servoed
    assert np.linalg.norm(found - path.pose[:, :3], axis=1).max() > 5e-3
