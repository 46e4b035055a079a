"""What decides a case's numbers, so that no record of other code is taken for today's."""

import hashlib
import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .physics_json import plain

if TYPE_CHECKING:
    from ..models.validation import Case

FIELDS = ("seed", "model", "settings", "code")


def case_identity(case: "Case", seed: int) -> dict[str, Any]:
    """What a finished record must agree with to be used again.

    The simulator is known by its version alone, which rises with every change of its bits.
    """
    from ..models import MODEL_VERSION

    digest = hashlib.sha256()
    for source in _sources(case):
        digest.update(source.read_bytes())
    return {
        "seed": seed,
        "model": MODEL_VERSION,
        "settings": plain(case.settings),
        "code": digest.hexdigest()[:16],
    }


def has_identity(record: Mapping[str, Any], identity: Mapping[str, Any]) -> bool:
    """The record is of the same seed, model, settings and code."""
    return all(record.get(field) == identity[field] for field in FIELDS)


def _sources(case: "Case") -> Iterator[Path]:
    """The case's own file, what it shares with its neighbours, all truths and analysis."""
    from ..models.validation import analysis, truths

    own = Path(inspect.getfile(case.run))
    yield own
    yield from sorted(own.parent.glob("_*.py"))
    for package in (analysis, truths):
        yield from sorted(Path(inspect.getfile(package)).parent.glob("*.py"))
