import numpy as np
from bolfi_liquids.hardware import bundled_rig
from bolfi_liquids.hardware.emulator.commands import SERVO_RATE
from bolfi_liquids.hardware.emulator.controller import Controller, Options
from bolfi_liquids.hardware.emulator.motion import servo
from bolfi_liquids.hardware.emulator.servoed_path import servoed
from bolfi_liquids.hardware.motion import stir
from bolfi_liquids.hardware.motion.cup_frame import cup_frame
from bolfi_liquids.hardware.motion.kinematics import inverse
from bolfi_liquids.hardware.robot.ur import LOOKAHEAD, SERVO_GAIN
from bolfi_liquids.hardware.safety.limits import workspace

RIG = bundled_rig()


def test_the_arm_that_is_servoed_along_a_stir_is_where_it_was_reckoned():
    path, space, frame = stir(RIG), workspace(RIG, "stirring"), cup_frame(RIG.cup)
    base = frame.to_base(path.pose)
    start = inverse(space.arm, base[0], space.start, tcp=space.tcp).joints
    controller = Controller(Options(joints=tuple(start.tolist()), tcp=tuple(space.tcp)))
    arm, way = controller.arm, []
    for pose in base:
        target = arm.tool.joints(pose, arm.state.joints)
        motion = servo(arm.tool.arm, target, LOOKAHEAD, SERVO_GAIN, SERVO_RATE)
        arm.begin([lambda _, motion=motion: motion])
        way.append(controller.tick().pose)
    found = frame.from_base(np.array(way))[:, :3]
    off = np.linalg.norm(found - servoed(path).position, axis=1)
    assert off.max() < 1e-4
    # against a path that was not servoed
    assert np.linalg.norm(found - path.pose[:, :3], axis=1).max() > 5e-3
