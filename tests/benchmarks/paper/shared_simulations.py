"""Simulations and calibrations that figures share; each is made once and kept."""

from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import Compute
from xarray import Dataset

from bolfi_liquids.calibration.calibrate import calibrate
from bolfi_liquids.calibration.result import Calibration
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.pouring.landing_map import LandingMap
from bolfi_liquids.progress import progress_bar
from bolfi_liquids.run.results import generations
from bolfi_liquids.run.run import SIMULATIONS

from .decisions import map_of_all_liquids
from .learners import after_strokes, by_stirring_and_pouring
from .study import spillage_study
from .study_size import Scale


@dataclass(frozen=True, eq=False)
class SharedSimulations:
    """Simulations and calibrations that figures share.

    Attributes:
        out: Directory of the results.
        scale: How much is simulated.
        bank: Every finished simulation and calibration; in `out`.
        executor: Processes that share the work; None is this process.
    """

    out: Path
    scale: Scale
    bank: SimulationBank
    executor: Executor | None = None

    @property
    def compute(self) -> Compute:
        """Where simulations are made and kept."""
        return Compute(bank=self.bank, executor=self.executor)

    @cached_property
    def landing_map(self) -> LandingMap:
        """Of all liquids and the bundled cups, by which actions are chosen."""
        count = self.scale.pours
        with progress_bar("pouring", count, shown=True) as advance:
            return map_of_all_liquids(count, self.compute, advance)

    @cached_property
    def study(self) -> Dataset:
        """Spillage after stirring and after pouring; see `spillage_study`."""
        cups, bank = self.landing_map.cups, self.out / SIMULATIONS
        learners = by_stirring_and_pouring(cups, self.scale, bank)
        return spillage_study(learners, self.landing_map, self.scale, self.compute)

    @cached_property
    def strokes(self) -> Dataset:
        """The same after stirring for some strokes only."""
        learners = after_strokes(self.scale, self.out / SIMULATIONS)
        return spillage_study(learners, self.landing_map, self.scale, self.compute)

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
            executor=self.executor,
        )
