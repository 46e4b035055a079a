"""What the figures are made from: simulations that are kept, made once for all figures."""

from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..calibration.calibrate import calibrate
from ..calibration.result import Calibration
from ..inference.simulations import Keep
from ..inputs.bundled import bundled_recording
from ..inputs.cups import bundled_cups
from ..inputs.prior import default_prior
from ..pouring.grid import PourGrid, make_grid
from ..progress import progress_bar
from ..run.directory import SIMULATIONS
from ..run.provenance import generations
from .learners import after_strokes, by_stirring_and_pouring
from .scale import Scale
from .sticky_study import Stuck, spilled_where_it_sticks
from .study import spillage_study
from .truths import DENSITY

if TYPE_CHECKING:
    from xarray import Dataset

    from ..inference import SimulationBank
    from .calibrations import Learner


@dataclass(frozen=True, eq=False)
class Workshop:
    """Where figures find their material.

    Attributes:
        out: Directory of the results.
        scale: How much is simulated.
        bank: Every finished simulation and calibration.
        pool: Of processes that share the work; None for this one alone.
        progress: Show bars on stderr.
    """

    out: Path
    scale: Scale
    bank: "SimulationBank"
    pool: Executor | None = None
    progress: bool = True

    @cached_property
    def grid(self) -> PourGrid:
        """Of pours with the bundled cups, by which actions are chosen."""
        size = self.scale.grid
        with progress_bar("pouring a grid of liquids", size.rates, shown=self.progress) as advance:
            cups, prior = bundled_cups(), default_prior()
            return make_grid(cups, DENSITY, prior, Keep(self.bank), advance, size=size)

    @cached_property
    def study(self) -> "Dataset":
        """Spillage after stirring and after pouring; see `spillage_study`."""
        return self._studied(
            by_stirring_and_pouring(self.grid.cups, self.scale, self.out / SIMULATIONS)
        )

    @cached_property
    def strokes(self) -> "Dataset":
        """The same after stirring for some strokes only."""
        return self._studied(after_strokes(self.scale, self.out / SIMULATIONS))

    def _studied(self, learners: "Mapping[str, Learner]") -> "Dataset":
        return spillage_study(
            learners, self.bank, self.grid, self.scale, self.pool, progress=self.progress
        )

    def begin_sticky(self) -> None:
        """Let a pool begin on the liquids that stick, which take longest and wait for nothing."""
        _ = self._sticking

    @cached_property
    def sticky(self) -> list[Stuck]:
        """Adhesive liquids and their spillage."""
        found, shown = [], self.progress and self.pool is not None
        with progress_bar("liquids that stick", self.scale.sticky, shown=shown) as advance:
            for one in self._sticking:
                found.append(one)
                advance(1)
        return found

    @cached_property
    def _sticking(self) -> Iterator[Stuck]:
        progress = self.progress and not self.pool
        one = partial(spilled_where_it_sticks, self.out, self.runs, self.scale, progress=progress)
        return (self.pool.map if self.pool else map)(one, range(self.scale.sticky))

    @property
    def runs(self) -> Path:
        """Where calibrations on recordings are kept; another version's are left alone."""
        made_by = "_".join(f"{part}_{number}" for part, number in generations().items())
        return self.out / "runs" / made_by

    def calibration(self, liquid: str, budget: int, surrogate: str) -> Calibration:
        """Of a bundled recording, in a run of its own; a finished one is opened."""
        return calibrate(
            bundled_recording(liquid),
            out=self.runs / f"{liquid}_{budget}_{surrogate}",
            budget=budget,
            surrogate=surrogate,
            particles=self.scale.particles,
            seed=self.scale.seed,
            resume=True,
            progress=self.progress,
        )
