"""Directories for the libraries that keep files of their own, where a user has none for them."""

import contextlib
import os
import pwd
import tempfile


def ensure_home() -> None:
    """Give libraries a directory to write to, in this process and those that it starts.

    In a container a user may have no home, nor an entry in passwd. Matplotlib and ArviZ then fail
    when they are imported, and Taichi aborts the process: HOME is set. A home that cannot be
    written is left alone, for people read from it and no result may go elsewhere than they said;
    only the libraries' caches are moved, without which Taichi crashes at the end.
    """
    with contextlib.suppress(OSError):  # no directory for temporary files either
        home = os.environ.get("HOME", "")
        if not os.path.isabs(home):
            home = os.environ["HOME"] = _of_passwd() or _made_temporary()
        if not _usable(home):
            elsewhere = _made_temporary()
            for name, place in (("XDG_CACHE_HOME", ".cache"), ("MPLCONFIGDIR", ".matplotlib")):
                if not _usable(os.environ.get(name, "")):
                    os.environ[name] = os.path.join(elsewhere, place)
                    os.makedirs(os.environ[name], exist_ok=True)


def _of_passwd() -> str:
    """The home that the computer knows for this user, if it can be written; else ""."""
    with contextlib.suppress(KeyError):
        home = pwd.getpwuid(os.getuid()).pw_dir
        return home if _usable(home) else ""
    return ""


def _made_temporary() -> str:
    """A directory that serves a user without a home."""
    home = os.path.join(tempfile.gettempdir(), f"bolfi-liquids-{os.getuid()}")
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
    return os.access(place, os.W_OK | os.X_OK)  # asked, not tried: an import writes nothing
