"""Show a bare environment the packages that a wheel declares, and no others.

    python declared.py SITE_PACKAGES [EXTRA ...]

They are links to the packages of the environment that runs this, so that nothing is downloaded
again. What is imported without being declared, or only by an extra that was not asked for, is
missing there as it would be for a user.
"""

import re
import sys
from importlib.metadata import Distribution, distribution, distributions
from pathlib import Path

from packaging.requirements import Requirement

WHEEL = "bolfi-liquids"


def required(one: Distribution, extras: frozenset[str], found: dict[str, frozenset[str]]) -> None:
    """Add to `found`, by name, the extras of all that a distribution requires, and so on."""
    for text in one.requires or []:
        need = Requirement(text)
        if need.marker and not any(need.marker.evaluate({"extra": e}) for e in {"", *extras}):
            continue
        name = re.sub(r"[-_.]+", "-", need.name).lower()
        known = found.get(name, frozenset())
        if name not in found or need.extras - known:
            found[name] = known | need.extras
            # an extra of the wheel itself is a requirement of the wheel's
            required(one if name == WHEEL else distribution(name), found[name], found)


def top_level(one: Distribution) -> set[Path]:
    """What a distribution has put into site-packages: packages, modules, metadata."""
    names = {
        file.parts[0] for file in one.files or [] if file.parts[0] not in ("..", "__pycache__")
    }
    return {Path(str(one.locate_file(name))) for name in names}


def main(site: Path, extras: frozenset[str]) -> None:
    (wheel,) = distributions(name=WHEEL, path=[str(site)])
    found: dict[str, frozenset[str]] = {}
    required(wheel, extras, found)
    names = found.keys() - {WHEEL}
    for path in {path for name in names for path in top_level(distribution(name))}:
        link = site / path.name
        if not link.exists():
            link.symlink_to(path)
    print(f"{len(names)} packages of {WHEEL}[{','.join(sorted(extras))}] in {site}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), frozenset(sys.argv[2:]))
