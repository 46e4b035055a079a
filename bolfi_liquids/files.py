"""Files that are there to be read, and files that are written whole or not at all."""

import os
import tempfile
from pathlib import Path

from .errors import InputError
from .hardware.whole_files import disk_errno as disk_errno
from .hardware.whole_files import write_netcdf as write_netcdf
from .hardware.whole_files import write_whole as write_whole


def as_path(given: object, where: str) -> Path:
    """A path that a person gave.

    Raises:
        InputError: It is something else.
    """
    if not isinstance(given, str | os.PathLike):
        raise InputError(
            f"{given!r:.80} is no path", where=where, fix="give text or a pathlib.Path"
        )
    return Path(given)


def existing_file(path: str | Path) -> Path:
    """`path`, which a person gave to be read.

    Raises:
        InputError: There is no such file, or it is a directory.
    """
    path = as_path(path, "path")
    if not path.is_file():
        what = "a directory, not a file" if path.is_dir() else "no such file"
        raise InputError(what, where=str(path), fix="check the path")
    return path


def given_path(path: str | Path, where: str) -> Path:
    """A path that a person gave to be written to.

    Args:
        path: As given.
        where: The option or argument.

    Raises:
        InputError: It is no path, or empty, as a shell leaves a variable that is not set; "."
            says the current directory.
    """
    given = as_path(path, where)
    if not str(path).strip():  # Path("") is the current directory
        raise InputError("is empty", where=where, fix="give a path; was a variable not set?")
    return given


def new_file(path: str | Path, where: str, *, suffix: str = "", replace: bool = True) -> Path:
    """A path that a person gave, to be written as a file.

    Args:
        path: As given.
        where: The option or argument.
        suffix: In which its name must end, in lower or upper case.
        replace: Whether there may be a file already.

    Raises:
        InputError: See `given_path`; or the name ends otherwise, is that of a directory or of a
            file, or no file can be made in its directory.
    """
    path = given_path(path, where)
    ends_otherwise, parent = suffix and path.suffix.lower() != suffix, path.parent
    for wrong, at, what, fix in (
        (ends_otherwise, path, f"ends in {path.suffix!r}", f"give a name in {suffix}"),
        (path.exists() and not replace, path, "exists already", "choose another name"),
        (not parent.is_dir(), parent, "no such directory", "make it first"),
        (path.is_dir(), path, "is a directory", "give the name of a file"),
    ):
        if wrong:
            raise InputError(what, where=str(at), fix=fix)
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as err:
        fix = "choose a place that can be written"
        raise InputError(f"{err.strerror}", where=str(path.parent), fix=fix) from err
    return path


def write_text(path: Path, text: str) -> Path:
    """Write UTF-8 text by `write_whole`."""
    return write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
