"""What the robot does: stirring patterns."""

from .patterns import Path, circle, star

__all__ = ["Path", "circle", "star"]
