"""The figures by name, and how they are drawn, one after the other."""

import json
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import asdict
from pathlib import Path

from bolfi_liquids.run.results import generations, versions
from bolfi_liquids.run.run import Run, alone_in

from .figure import Drawn
from .figure_of_geometry import geometry
from .figure_of_recordings import recordings
from .figure_of_strokes import strokes
from .figures_of_fits import inclination, posterior
from .figures_of_spillage import decision, liquids, spillage, surrogates
from .shared_simulations import SharedSimulations
from .study_size import Scale

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
}
"""By name, in the order in which they are made."""


def draw_figures(
    names: Iterable[str], out: Path, scale: Scale, executor: Executor | None = None
) -> Iterator[tuple[str, Drawn]]:
    """Make figures: NAME.png, NAME.svg and the numbers in NAME.nc.

    Every finished simulation, and every finished calibration, is kept in `out`: the same call
    goes on where the last one ended.

    Args:
        names: Of `FIGURES`.
        out: Directory of the results; made if missing.
        scale: How much is simulated.
        executor: Processes that share the work; None is this process.

    Yields:
        Each figure with its name, as soon as it is written.
    """
    chosen = list(dict.fromkeys(names))
    made_with = {"scale": asdict(scale), **generations(), "versions": versions()}
    with alone_in(out), Run(out, {}).bank() as bank:
        shared = SharedSimulations(out, scale, bank, executor)
        for name in chosen:
            began = time.perf_counter()
            drawn = FIGURES[name](shared)
            drawn.write(out, name, json.dumps(made_with | {"seconds": time.perf_counter() - began}))
            yield name, drawn
