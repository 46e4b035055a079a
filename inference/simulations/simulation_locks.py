"""Which simulations are being made at this moment, among all threads and processes of a bank.

A claim is a lock on one byte of a file, which the operating system releases when the process
ends, however it ends: nothing has to be cleaned up after a crash, and no clock decides whether
the claimant lives. Where such locks are missing (Windows) only threads see each other's claims.
"""

import hashlib
import os
import threading

try:
    import fcntl
except ModuleNotFoundError:
    fcntl = None


class Claims:
    """Claims of this process.

    Use `share`: closing any descriptor of a file drops the whole process's locks on it, so there
    may be only one object per file.

    Args:
        path: File to lock in, created with the first claim; None shares with no other process.
    """

    def __init__(self, path: str | None):
        self._path = path
        self._descriptor: int | None = None
        self._held: set[int] = set()
        self._lock = threading.Lock()
        self._users = 0

    @classmethod
    def share(cls, path: str | None) -> "Claims":
        """The one object for a path; `close` it when done."""
        with _opening:
            path = path and os.path.realpath(path)
            claims = _by_path.setdefault(path, cls(path)) if path else cls(None)
            claims._users += 1
            return claims

    def take(self, key: str) -> bool:
        """Claim `key`; False if it is claimed already, here or in another process."""
        place = _place(key)
        with self._lock:
            if place in self._held or not self._lock_byte(place):
                return False
            self._held.add(place)
            return True

    def give_back(self, key: str) -> None:
        """End a claim, if it is held."""
        place = _place(key)
        with self._lock:
            if place not in self._held:
                return
            self._held.remove(place)
            if fcntl is not None and self._descriptor is not None:
                fcntl.lockf(self._descriptor, fcntl.LOCK_UN, 1, place)

    def close(self) -> None:
        """End all claims, once nobody in this process uses the file any more."""
        with _opening:
            self._users -= 1
            if self._users:
                return
            if self._path:
                _by_path.pop(self._path, None)
        with self._lock:
            self._held.clear()
            if self._descriptor is not None:
                os.close(self._descriptor)
                self._descriptor = None

    def _lock_byte(self, place: int) -> bool:
        if fcntl is None or self._path is None:
            return True
        if self._descriptor is None:
            self._descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.lockf(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
        except (BlockingIOError, PermissionError):  # systems differ in how they say "taken"
            return False
        return True


_opening = threading.Lock()
_by_path: dict[str, Claims] = {}


def _place(key: str) -> int:
    """A byte in [0, 2^62), beyond any file's end, which does not matter to locks."""
    return int.from_bytes(hashlib.blake2b(key.encode(), digest_size=8).digest(), "big") >> 2
