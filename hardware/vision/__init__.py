"""From pictures to the stick's inclination."""

from .camera_model import CameraModel, CameraModelError, look_at, read_camera, write_camera
from .charuco import Board, CalibrationError, Intrinsics, calibrate_intrinsics
from .clock import Clock, ClockError, GripperSamples, fit_clock
from .frame import Frame
from .frame_measurement import Flag, FrameMeasurement, line_is_good, marker_is_good
from .inclination import Inclination, ViewLines, direction, inclination
from .joining import JoinedInclination, View, join
from .measuring import FrameMeter, Track, measure
from .plumb_line import Levelled, PlumbLineError, level_camera
from .pose_refinement import PoseError, RefinedPose, refine_orientation
from .series import FrameSeries, as_series, interpolate_lines
from .stick_view import StickView, ViewError

__all__ = [
    "Board",
    "CalibrationError",
    "CameraModel",
    "CameraModelError",
    "Clock",
    "ClockError",
    "Flag",
    "Frame",
    "FrameMeasurement",
    "FrameMeter",
    "FrameSeries",
    "GripperSamples",
    "Inclination",
    "Intrinsics",
    "JoinedInclination",
    "Levelled",
    "PlumbLineError",
    "PoseError",
    "RefinedPose",
    "StickView",
    "Track",
    "View",
    "ViewError",
    "ViewLines",
    "as_series",
    "calibrate_intrinsics",
    "direction",
    "fit_clock",
    "inclination",
    "interpolate_lines",
    "join",
    "level_camera",
    "line_is_good",
    "look_at",
    "marker_is_good",
    "measure",
    "read_camera",
    "refine_orientation",
    "write_camera",
]
