"""Gravity."""

GRAVITY = 9.81  # m/s²
