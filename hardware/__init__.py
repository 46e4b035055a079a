"""What the robot does: stirring patterns."""

from .patterns import Path, star

__all__ = ["Path", "star"]
