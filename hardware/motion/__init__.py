"""Kinematics and the paths of the gripper."""
