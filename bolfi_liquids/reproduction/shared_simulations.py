"""Simulations and calibrations that figures share; each is made once and kept."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..calibration.calibrate import calibrate
from ..calibration.result import Calibration
from ..inputs.bundled import bundled_recording
from ..inputs.cups import bundled_cups
from ..inputs.prior import default_prior
from ..pouring.landed_pours import LandedPours
from ..pouring.landing_map import LandingMap, map_of_prior
from ..progress import progress_bar
from ..run.execution import HERE, Execution
from ..run.provenance import generations
from ..run.run import SIMULATIONS
from .learners import after_strokes, by_stirring_and_pouring
from .sticky_study import Stuck, spilled_where_it_sticks
from .study import spillage_study
from .study_size import Scale
from .truths import DENSITY

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from xarray import Dataset

    from ..inference import SimulationBank
    from .calibrations import Learner


@dataclass(frozen=True, eq=False)
class SharedSimulations:
    """Simulations and calibrations that figures share.

    Attributes:
        out: Directory of the results.
        scale: How much is simulated.
        bank: Every finished simulation and calibration.
        execution: How simulations are made.
    """

    out: Path
    scale: Scale
    bank: "SimulationBank"
    execution: Execution = HERE

    @cached_property
    def landing_map(self) -> LandingMap:
        """Of all liquids and the bundled cups, by which actions are chosen."""
        count, keep = self.scale.pours, self.execution.keep(self.bank)
        with progress_bar("pouring", count, shown=self.execution.progress) as advance:
            pours = LandedPours(bundled_cups(), DENSITY)
            return map_of_prior(default_prior(), pours, count, keep, advance)

    @cached_property
    def study(self) -> "Dataset":
        """Spillage after stirring and after pouring; see `spillage_study`."""
        made = self._learners_bank, self.execution.timeout
        return self._studied(by_stirring_and_pouring(self.landing_map.cups, self.scale, *made))

    @cached_property
    def strokes(self) -> "Dataset":
        """The same after stirring for some strokes only."""
        return self._studied(after_strokes(self.scale, self._learners_bank, self.execution.timeout))

    @property
    def _learners_bank(self) -> str | Path:
        """Of the simulations within a calibration; workers of another computer do not reach `out`.

        What was concluded is kept in `out` in any case.
        """
        return self.out / SIMULATIONS if self.execution.local else ":memory:"

    def _studied(self, learners: "Mapping[str, Learner]") -> "Dataset":
        return spillage_study(learners, self.bank, self.landing_map, self.scale, self.execution)

    def begin_sticky(self) -> None:
        """Start the sticky liquids in the pool: they take longest and depend on nothing else."""
        _ = self._sticking

    @cached_property
    def sticky(self) -> list[Stuck]:
        """Adhesive liquids and their spillage."""
        found, shown = [], self.execution.progress and self._pool is not None
        with progress_bar("liquids that stick", self.scale.sticky, shown=shown) as advance:
            for one in self._sticking:
                found.append(one)
                advance(1)
        return found

    @cached_property
    def _sticking(self) -> Iterator[Stuck]:
        """Results as they come.

        A local pool takes whole liquids. Other workers do not reach the directory of a run, so
        they only simulate.
        """
        execution = self.execution if self._pool is None else self.execution.of_a_worker()
        one = partial(spilled_where_it_sticks, self.out, self.runs, self.scale, execution=execution)
        return (map if self._pool is None else self._pool.map)(one, range(self.scale.sticky))

    @property
    def _pool(self) -> "Executor | None":
        """Of processes on this computer."""
        return self.execution.executor if self.execution.local else None

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
            **self.execution._asdict(),
        )
