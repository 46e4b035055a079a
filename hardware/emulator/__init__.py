"""Emulator of a UR controller: a process of its own that serves the real ur_rtde client.

It answers as the controller does: registers, recipes, the control script's commands and threads,
watchdog, protective stop, dashboard. Motions are kinematic: straight lines, trapezoidal speeds,
joint and TCP speed limits. Not emulated: forces and inertia of the arm, payload errors, blends
(a path stops at its corners), the real servo filter (an assumed one stands for it), safety planes,
force mode, servoC, moveP, freedrive, scripts other than ur_rtde's. Passing here is no acceptance
test of a robot.
"""

from .admin_client import Admin, EmulatedArmState
from .process import EmulatorProcess
from .servers.network import check_address

__all__ = ["Admin", "EmulatedArmState", "EmulatorProcess", "check_address"]
