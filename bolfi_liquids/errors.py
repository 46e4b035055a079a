"""The one error that a person's input can cause, always a single line."""

import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError


def one_line(text: str) -> str:
    """A text without its line breaks; blanks stay, which a path in it may have."""
    return " ".join(line.strip() for line in text.strip().splitlines())


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
        """Error in one line, with options as they are typed.

        Args:
            options: Of the command, by the names of Python's arguments, which `fix` has in
                backticks.
        """
        where = self.where.as_typed(options) if isinstance(self.where, Argument) else self.where
        fix = re.sub(r"`(\w+)`", lambda name: options.get(name[1], name[0]), self.fix)
        return one_line(f"{where}: {self.what}; {fix}")

    @classmethod
    def from_validation(
        cls, err: "ValidationError", *, where: Callable[[str], str]
    ) -> "InputError":
        """The first fault that pydantic found in settings.

        Args:
            err: Of a dataclass.
            where: Names a field's option, from its dotted name; "" is the whole.
        """
        first = err.errors(include_url=False)[0]
        own = first.get("ctx", {}).get("error")
        if isinstance(own, cls):
            return own
        rule = first["msg"].removeprefix("Value error, ").replace("Input should", "it must", 1)
        return cls(
            f"{first['input']!r:.80}", where=where(".".join(map(str, first["loc"]))), fix=rule
        )

    def __reduce__(self):
        """It reaches the terminal from the processes that share long work, too."""
        return partial(InputError, where=self.where, fix=self.fix), (self.what,)
