"""A rig that is emulated: an arm in the process that commands it, and rendered cameras.

Motions are kinematic: the arm follows its set-points by an assumed filter, within the speeds of its
joints and of the tool's centre. Not emulated: forces and inertia of the arm, payload errors, the
real servo filter, safety planes. Passing here is no acceptance test of a robot.
"""
