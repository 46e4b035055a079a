"""Cameras whose frame is tipped about the x axis: `camera_tilt` for the other camera.

Each camera is rolled on a tripod of its own, so the two effects are two coefficients. This one
rolls the camera that looks along x, at the yz plane, and leaves out how the other one is pitched.
"""

from .camera_tilt import rolled

EFFECT = rolled(
    "camera_tilt_yz",
    1,
    "The camera that looks along x is rolled: the inclination in the yz plane shows a constant "
    "offset.",
)
