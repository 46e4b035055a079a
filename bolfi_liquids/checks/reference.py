"""A directory of a reference solver's stirs and pours in liquids that are known."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from ..errors import Argument, InputError
from ..files import as_path
from .reference_pours import POUR_TRUTHS, PouredLiquid, open_poured_liquids
from .reference_stirs import TRUTHS, ReferenceStir, ReferenceStirs, open_reference_stirs


@dataclass(frozen=True, eq=False)
class Reference:
    """Stirs, pours or both, with their truths.

    Attributes:
        path: The directory.
        stirs: Those whose hidden effect is known, or that have none, from the thinnest liquid to
            the thickest.
        left_out: Name -> hidden effect of the others.
        pours: Of each liquid from each cup, from the thinnest liquid to the thickest.
        hashes: SHA-256 of the tables of truths, in hexadecimal, by the files' names.
    """

    path: Path
    stirs: tuple[ReferenceStir, ...]
    left_out: Mapping[str, str]
    pours: tuple[PouredLiquid, ...]
    hashes: Mapping[str, str]

    def chosen(self, names: Iterable[str]) -> tuple[ReferenceStir | PouredLiquid, ...]:
        """Stirs by the names of their files, with or without the ending, and pours by liquid and
        contact angle; all for no names.

        Raises:
            InputError: One is not here, or holds an effect.
        """
        wanted = [name.removesuffix(".nc") for name in names]
        known = {one.name: one for one in (*self.stirs, *self.pours)}
        for name in wanted:
            if name not in known:
                effect = self.left_out.get(name)
                what = f"no recording or pour {name!r} in {self.path}"
                if effect:
                    what = f"recording {name!r} holds the hidden effect {effect}, of no known size"
                fix = f"choose from {', '.join(known)}, or leave `against` out to run other cases"
                raise InputError(what, where=Argument("names"), fix=fix)
        return tuple(known[name] for name in known if name in (wanted or known))


def open_reference(path: str | Path) -> Reference:
    """Read a reference, so that nothing is found wrong later.

    Args:
        path: A directory that holds truths.csv with recordings, see `open_reference_stirs`,
            pour_truths.csv with pours, see `open_poured_liquids`, or both.

    Raises:
        InputError: The directory, a table or a recording cannot be used; the message names file,
            line, column and value.
    """
    folder = as_path(path, Argument("against"))
    if not folder.is_dir():
        what = "a file, not a directory" if folder.exists() else "no such directory"
        raise InputError(what, where=str(folder), fix="give that of the reference")
    tables = [name for name in (TRUTHS, POUR_TRUTHS) if (folder / name).is_file()]
    if not tables:
        raise InputError(
            f"holds neither {TRUTHS} of recordings nor {POUR_TRUTHS} of pours",
            where=str(folder),
            fix="write a row for each; `bolfi-liquids guide files` has the columns",
        )
    stirs = open_reference_stirs(folder) if TRUTHS in tables else ReferenceStirs((), {})
    pours = open_poured_liquids(folder) if POUR_TRUTHS in tables else ()
    if both := {stir.name for stir in stirs.stirs} & {pour.name for pour in pours}:
        fix = "rename the recording"
        raise InputError(
            f"a recording and pours are named {both.pop()}", where=str(folder), fix=fix
        )
    hashes = {name: sha256((folder / name).read_bytes()).hexdigest() for name in tables}
    return Reference(folder, *stirs, pours, hashes)
