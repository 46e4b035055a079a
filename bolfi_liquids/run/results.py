"""Results on disk: netCDF trees, each followed by the digest of all its bytes, and summary.json.

HDF5 ignores what follows its content, so other programs read the trees, too. Nothing here reads
summary.json, the numbers of a run for people and other programs: each result carries its own
section.
"""

import json
import math
import platform
from collections.abc import Mapping
from functools import cache, lru_cache
from hashlib import sha256
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import BeforeValidator, TypeAdapter

from ..files import write_whole
from ..hardware.whole_files import netcdf_content

if TYPE_CHECKING:
    from xarray import DataTree

MARK = b"\nsha256 "
END = len(MARK) + 2 * sha256().digest_size
SUMMARY_FILE = "summary.json"
LIBRARIES = ("bolfi-liquids", "numpy", "scipy", "jax", "numpyro", "emcee", "taichi", "xarray")

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A number that may be NaN, for which JSON has `null`."""


def write_result(tree: "DataTree", path: Path) -> None:
    """Write a tree whole or not at all."""
    content = netcdf_content(tree)
    write_whole(path, lambda temporary: temporary.write_bytes(content + _end_of(content)))


def is_result(path: Path) -> bool:
    """Whether `write_result` wrote a file, which may be damaged."""
    return path.read_bytes()[-END:].startswith(MARK)


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


class Section:
    """A section of summary.json; its subclasses are frozen dataclasses that list the fields."""

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Self:
        """The section that `to_json` gave."""
        return _adapter(cls).validate_python(values)

    def to_json(self) -> dict[str, Any]:
        """The section as `json.dumps` takes it; what is not finite (R-hat of one chain) is None."""
        return json.loads(_adapter(type(self)).dump_json(self, by_alias=True))


@cache
def _adapter(kind: type) -> TypeAdapter:
    return TypeAdapter(kind)


def generations() -> dict[str, str]:
    """Versions of engine and model; results of another version are other results."""
    from ..inference.engine_version import ENGINE_VERSION
    from ..models import MODEL_VERSION

    return {"engine": ENGINE_VERSION, "model": MODEL_VERSION}


def versions() -> dict[str, str]:
    """Versions of Python, the program and its libraries."""
    return {"python": platform.python_version()} | {name: version(name) for name in LIBRARIES}
