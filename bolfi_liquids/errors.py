"""The one error that a person's input can cause, always a single line."""

from functools import partial


class InputError(ValueError):
    """Something a person gave cannot be used.

    Args:
        what: What is wrong, with the field and the value received.
        where: The file, field or option it is wrong in.
        fix: What to do about it.
    """

    def __init__(self, what: str, *, where: str, fix: str):
        super().__init__(f"{where}: {what}; {fix}")
        self.what = what
        self.where = where
        self.fix = fix

    def __reduce__(self):
        """It reaches the terminal from the processes that share long work, too."""
        return partial(InputError, where=self.where, fix=self.fix), (self.what,)
