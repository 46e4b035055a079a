"""Errors of the rig that a person can mend, always a single line."""

from functools import partial


class RigError(ValueError):
    """Something that was given, or that is connected, cannot be used.

    Args:
        what: What is wrong, with the value received.
        where: The file and field, the device or the option it is wrong in.
        fix: What to do about it.
    """

    def __init__(self, what: str, *, where: str, fix: str):
        super().__init__(f"{where}: {what}; {fix}")
        self.what = what
        self.where = where
        self.fix = fix

    def __reduce__(self):
        # exceptions cross process borders, and pickle knows positional arguments only
        return partial(type(self), self.what, where=self.where, fix=self.fix), ()


class MotionRejected(RigError):
    """A commanded motion breaks a limit; nothing of it was carried out."""


def missing_extra(package: str, extra: str, user: str) -> ImportError:
    """The error of an optional package that is not installed."""
    return ImportError(f"{user} needs {package}: pip install 'bolfi-liquids[{extra}]'")
