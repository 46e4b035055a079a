"""`reproduce`: the paper's figures from one command."""

import json
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

from ..errors import Argument, InputError
from ..files import given_path
from ..inference.simulations import Workers
from ..run.execution import Execution
from ..run.lock import alone_in
from ..run.provenance import LIBRARIES, generations, versions
from ..run.run import Run
from ..run.workers import open_workers
from .figure import Drawn
from .figure_of_adhesion import adhesion
from .figure_of_geometry import geometry
from .figure_of_recordings import recordings
from .figure_of_strokes import strokes
from .figures_of_fits import inclination, posterior
from .figures_of_spillage import decision, liquids, spillage, surrogates
from .shared_simulations import SharedSimulations
from .study_size import FULL, Scale

FIGURES: dict[str, Callable[[SharedSimulations], Drawn]] = {
    "inclination": inclination,
    "posterior": posterior,
    "recordings": recordings,
    "geometry": geometry,
    "spillage": spillage,
    "liquids": liquids,
    "decision": decision,
    "surrogates": surrogates,
    "strokes": strokes,
    "adhesion": adhesion,
}
"""By name, in the order in which they are made."""


def reproduce(
    names: Iterable[str],
    out: str | Path,
    *,
    scale: Scale = FULL,
    executor: Workers | None = None,
    timeout: float | None = None,
    progress: bool = True,
) -> dict[str, Drawn]:
    """Make figures: NAME.png, NAME.svg and the numbers in NAME.nc.

    Every finished simulation, and every finished calibration, is kept in `out`: the same call
    goes on where the last one ended.

    Args:
        names: Of `FIGURES`; none, or "all", for all of them.
        out: Directory of the results; made if missing.
        scale: How much is simulated: `FULL`, `QUICK`, or one of your own.
        executor: Shares the work, see `calibrate`; None is this process.
        timeout: Seconds that one simulation may take; None sets no limit.
        progress: Whether to show bars on stderr.

    Returns:
        The figures by name, in the order in which they were asked for.

    Raises:
        InputError: There is no figure of that name.
    """
    with open_workers(executor, timeout) as pool:
        out = given_path(out, Argument("out"))
        return dict(draw_figures(names, out, scale, Execution(pool, timeout, progress)))


def draw_figures(
    names: Iterable[str], out: Path, scale: Scale, execution: Execution
) -> Iterator[tuple[str, Drawn]]:
    """As `reproduce`, each figure with its name as soon as it is written."""
    chosen = _chosen(names)
    made_with = {"scale": asdict(scale), **generations(), "versions": versions(LIBRARIES)}
    with alone_in(out), Run(out, {}).bank() as bank:
        shared = SharedSimulations(out, scale, bank, execution)
        if "adhesion" in chosen:
            shared.begin_sticky()
        for name in chosen:
            began = time.perf_counter()
            drawn = FIGURES[name](shared)
            drawn.write(out, name, json.dumps(made_with | {"seconds": time.perf_counter() - began}))
            yield name, drawn


def _chosen(names: Iterable[str]) -> list[str]:
    wanted = list(dict.fromkeys(names)) or ["all"]
    chosen = list(FIGURES) if "all" in wanted else wanted
    for name in chosen:
        if name not in FIGURES:
            raise InputError(
                f"no figure {name!r}", where="reproduce", fix=f"choose all, {', '.join(FIGURES)}"
            )
    return chosen
