"""The one error that a person's input can cause, always a single line."""

import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError
    from pydantic_core import ErrorDetails


class Argument(str):
    """The place of a fault: an argument by its name in Python, perhaps with more after a blank.

    The command line writes the option in the place of the name.
    """

    def as_typed(self, options: Mapping[str, str]) -> str:
        """With the option in the place of the name, where there is one; `options` are by name."""
        name, blank, rest = self.partition(" ")
        return f"{options.get(name, name)}{blank}{rest}"


class InputError(ValueError):
    """Something a person gave cannot be used.

    Args:
        what: What is wrong, with the field and the value received.
        where: The file or field it is wrong in, or the `Argument`.
        fix: What to do about it.
    """

    def __init__(self, what: str, *, where: str, fix: str):
        super().__init__(f"{where}: {what}; {fix}")
        self.what = what
        self.where = where
        self.fix = fix

    def as_typed(self, options: Mapping[str, str]) -> str:
        """The same in one line for a person who has typed a command.

        Args:
            options: Of the command, by the names of Python's arguments, which `fix` has in
                backticks.
        """
        where = self.where.as_typed(options) if isinstance(self.where, Argument) else self.where
        fix = re.sub(r"`(\w+)`", lambda name: options.get(name[1], name[0]), self.fix)
        return " ".join(f"{where}: {self.what}; {fix}".split())

    @classmethod
    def from_validation(
        cls, err: "ValidationError", *, where: Callable[[str], str], fix: str | None = None
    ) -> "InputError":
        """The first fault that pydantic found.

        Args:
            err: Of any model or dataclass.
            where: Names a field's file or option, from its dotted name; "" is the whole.
            fix: What to do about it; None gives the rule that the value breaks.
        """
        errors = err.errors(include_url=False)
        # a mistyped name is missing under its right one, too
        first = min(errors, key=lambda one: one["type"] != "extra_forbidden")
        own = first.get("ctx", {}).get("error")
        if isinstance(own, cls):
            return own
        place = where(".".join(map(str, first["loc"])))
        if fix is None:
            what, fix = (
                f"{first['input']!r:.80}",
                _said(first).replace("Input should", "it must", 1),
            )
        else:
            what = _fault(first, errors)
        return cls(what, where=place, fix=fix)

    def __reduce__(self):
        """It reaches the terminal from the processes that share long work, too."""
        return partial(InputError, where=self.where, fix=self.fix), (self.what,)


def _said(error: "ErrorDetails") -> str:
    return error["msg"].removeprefix("Value error, ")


def _fault(error: "ErrorDetails", errors: "list[ErrorDetails]") -> str:
    """What is wrong, and the value where it is short."""
    if error["type"] == "missing":
        return "is missing"
    if error["type"] == "extra_forbidden":
        beside = [
            str(other["loc"][-1])
            for other in errors
            if other["type"] == "missing" and other["loc"][:-1] == error["loc"][:-1]
        ]
        missing = f", and {', '.join(beside)} is missing" if beside else ""
        return f"is no field that is known{missing}"
    given = error["input"]
    return _said(error) + (f", got {given!r:.80}" if isinstance(given, str | int | float) else "")
