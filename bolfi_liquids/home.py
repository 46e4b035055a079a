"""A home directory for the libraries that need one."""

import contextlib
import os
import tempfile


def ensure_home() -> None:
    """Set HOME, for this process and those that it starts, unless it is there and can be written.

    In a container a user may have none, nor an entry in passwd. Matplotlib and ArviZ then fail when
    they are imported, and Taichi aborts the process; where it cannot write, it crashes at the end.
    """
    if _usable(os.environ.get("HOME", "")):
        return
    of_passwd = os.path.expanduser("~")
    with contextlib.suppress(OSError):  # no directory for temporary files either
        os.environ["HOME"] = of_passwd if _usable(of_passwd) else _made_temporary()


def temporary_home() -> str:
    """The directory that serves a user without a home."""
    return os.path.join(tempfile.gettempdir(), f"bolfi-liquids-{os.getuid()}")


def _made_temporary() -> str:
    home = temporary_home()
    with contextlib.suppress(FileExistsError):
        os.mkdir(home, mode=0o700)
    own = not os.path.islink(home) and os.stat(home).st_uid == os.getuid()
    # somebody else may have taken the name
    return home if own and _usable(home) else tempfile.mkdtemp(prefix="bolfi-liquids-")


def _usable(home: str) -> bool:
    """Whether libraries can keep their files in a home directory."""
    if not os.path.isabs(home):  # "~" where nobody knows a home
        return False
    place = os.path.join(home, ".cache")
    while not os.path.lexists(place):
        place = os.path.dirname(place)
    try:  # for root every directory looks writable
        os.rmdir(tempfile.mkdtemp(dir=place))
    except OSError:
        return False
    return True
