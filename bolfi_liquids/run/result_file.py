"""Results on disk: netCDF trees, each followed by the digest of all its bytes.

HDF5 ignores what follows its content, so other programs read these files, too.
"""

from functools import lru_cache
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from ..files import write_whole
from ..hardware.netcdf import netcdf_content

if TYPE_CHECKING:
    from xarray import DataTree

MARK = b"\nsha256 "
END = len(MARK) + 2 * sha256().digest_size


def write_result(tree: "DataTree", path: Path) -> None:
    """Write a tree whole or not at all."""
    content = netcdf_content(tree)
    write_whole(path, lambda temporary: temporary.write_bytes(content + _end_of(content)))


def read_result(path: Path) -> "DataTree":
    """The tree that `write_result` wrote.

    Raises:
        ValueError: The digest does not match.
        OSError: It cannot be read.
    """
    written = path.read_bytes()
    content, end = written[:-END], written[-END:]
    if end != _end_of(content):
        raise ValueError(f"{path} is damaged")
    return _parsed(content).copy(deep=True)  # what a caller changes is its own


def _end_of(content: bytes) -> bytes:
    return MARK + sha256(content).hexdigest().encode()


@lru_cache(maxsize=8)  # a command reads what the one before has written
def _parsed(content: bytes) -> "DataTree":
    import xarray

    with xarray.open_datatree(BytesIO(content), engine="h5netcdf") as tree:
        return tree.load()
