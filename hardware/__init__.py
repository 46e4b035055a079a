"""The robot, the cameras and the recording; what they are in a dry run; stirring patterns.

Loaded on use: importing this needs neither OpenCV nor ur-rtde.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .motion.patterns import Path, circle, star

if TYPE_CHECKING:
    from .board import host_time
    from .errors import MotionRejected, RigError
    from .motion.pour_paths import approach_pour, pour_path, ready_to_pour
    from .motion.stir_paths import (
        PosePath,
        above_cup,
        approach,
        insert,
        joined,
        retract,
        stir,
        strokes,
    )
    from .recorder.finalise import finalise, partial, rig_attributes
    from .rig import Camera, Rig
    from .rig_file import bundled_rig, open_rig
    from .safety.limits import Tool, check_path
    from .safety.preflight import Check
    from .session.camera_calibration import (
        CalibratedCamera,
        calibrate_camera,
        pictures_in,
        take_pictures,
        write_lens,
    )
    from .session.cameras import webcams
    from .session.confirmation import (
        SENTENCE,
        Confirmation,
        confirm,
        confirm_emulated,
        describe,
    )
    from .session.emulated import EmulatedRig, HiddenLiquid, emulated
    from .session.progress import Phase
    from .session.rig_check import check_rig
    from .session.session import Session, SessionStopped, Status
    from .session.setup import SessionSetup
    from .vision.charuco import Board

_HOME = {
    "Board": ".vision.charuco",
    "CalibratedCamera": ".session.camera_calibration",
    "Camera": ".rig",
    "Check": ".safety.preflight",
    "Confirmation": ".session.confirmation",
    "EmulatedRig": ".session.emulated",
    "HiddenLiquid": ".session.emulated",
    "MotionRejected": ".errors",
    "Phase": ".session.progress",
    "PosePath": ".motion.stir_paths",
    "Rig": ".rig",
    "RigError": ".errors",
    "SENTENCE": ".session.confirmation",
    "Session": ".session.session",
    "SessionSetup": ".session.setup",
    "SessionStopped": ".session.session",
    "Status": ".session.session",
    "Tool": ".safety.limits",
    "above_cup": ".motion.stir_paths",
    "approach": ".motion.stir_paths",
    "approach_pour": ".motion.pour_paths",
    "bundled_rig": ".rig_file",
    "calibrate_camera": ".session.camera_calibration",
    "check_path": ".safety.limits",
    "check_rig": ".session.rig_check",
    "confirm": ".session.confirmation",
    "confirm_emulated": ".session.confirmation",
    "describe": ".session.confirmation",
    "emulated": ".session.emulated",
    "finalise": ".recorder.finalise",
    "host_time": ".board",
    "insert": ".motion.stir_paths",
    "joined": ".motion.stir_paths",
    "open_rig": ".rig_file",
    "partial": ".recorder.finalise",
    "pictures_in": ".session.camera_calibration",
    "pour_path": ".motion.pour_paths",
    "ready_to_pour": ".motion.pour_paths",
    "retract": ".motion.stir_paths",
    "rig_attributes": ".recorder.finalise",
    "stir": ".motion.stir_paths",
    "strokes": ".motion.stir_paths",
    "take_pictures": ".session.camera_calibration",
    "webcams": ".session.cameras",
    "write_lens": ".session.camera_calibration",
}
__all__ = [
    "Board",
    "CalibratedCamera",
    "Camera",
    "Check",
    "Confirmation",
    "EmulatedRig",
    "HiddenLiquid",
    "MotionRejected",
    "Path",
    "Phase",
    "PosePath",
    "Rig",
    "RigError",
    "SENTENCE",
    "Session",
    "SessionSetup",
    "SessionStopped",
    "Status",
    "Tool",
    "above_cup",
    "approach",
    "approach_pour",
    "bundled_rig",
    "calibrate_camera",
    "check_path",
    "check_rig",
    "circle",
    "confirm",
    "confirm_emulated",
    "describe",
    "emulated",
    "finalise",
    "host_time",
    "insert",
    "joined",
    "open_rig",
    "partial",
    "pictures_in",
    "pour_path",
    "ready_to_pour",
    "retract",
    "rig_attributes",
    "star",
    "stir",
    "strokes",
    "take_pictures",
    "webcams",
    "write_lens",
]


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)
