import numpy as np
from bolfi_liquids.hardware import bundled_rig, emulated, servoed
from bolfi_liquids.hardware.motion import stir
from bolfi_liquids.hardware.motion.cup_frame import cup_frame
from stepped_clock import SteppedClock

RIG = bundled_rig()


def test_the_arm_that_is_servoed_along_a_stir_is_where_it_was_reckoned():
    path, frame = stir(RIG), cup_frame(RIG.cup)
    controller = emulated(RIG, path.pose[0]).controller
    clock = SteppedClock(controller.begun)
    arm = controller._replace(clock=clock).follower(RIG, "stirring")
    arm.connect()
    arm.take_control()
    way = []
    for pose in frame.to_base(path.pose):
        arm.command(pose)
        clock.sleep(1.0 / RIG.robot.rate)
        way.append(arm.read().pose)
    found = frame.from_base(np.array(way))[:, :3]
    off = np.linalg.norm(found - servoed(path).position, axis=1)
    assert off.max() < 1e-4
    # against a path that was not servoed
    assert np.linalg.norm(found - path.pose[:, :3], axis=1).max() > 5e-3
