"""Calibrations as pipelines of `inference.replicates`."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..calibration.engine_fit import confirmed, engine_options, fit_recordings
from ..inputs.settings import RUNS_PER_POINT, CalibrationSettings
from ..progress import silent
from ..seeds import Phase, simulation_seeds
from ..simulators import StirSimulator

if TYPE_CHECKING:
    from xarray import DataTree

    from ..inference import Prior
    from ..inference.criticism import Noise, SumOfNoises

SAMPLING: dict[str, Any] = {"sampler": "quadrature", "chains": 2, "draws": 250}
"""Of the posterior: independent draws, which take less time; `calibrate` checks its own against the
same quadrature."""


@dataclass(frozen=True)
class Observed:
    """Draws of a noise model over a whole signal.

    Attributes:
        noise: Of the cameras, and perhaps of the simulator's own error [rad].
    """

    noise: "Noise"

    def __call__(self, signal: NDArray, rng: np.random.Generator) -> NDArray[np.float64]:
        from ..inference.criticism.measurement_noise import samples

        return signal + self.noise.draw(rng, samples(signal), 1).reshape(signal.shape)


@dataclass(frozen=True)
class Calibrate:
    """Calibration of a signal as `calibrate` does it: a pipeline of `inference.replicates`.

    Attributes:
        stirring: The simulator; its recording's inclination is not looked at.
        prior: Of the parameters.
        settings: Budget and surrogate; the seed is each replicate's.
        timeout: Seconds that one simulation may take; None sets no limit.
    """

    stirring: StirSimulator
    prior: "Prior"
    settings: CalibrationSettings
    timeout: float | None = field(default=None, compare=False)  # it decides no draw

    def __call__(self, observed: NDArray, seed: int) -> "tuple[DataTree, Any]":
        from ..inference import SimulationBank
        from ..inference.simulations import Compute

        with SimulationBank(":memory:") as bank:
            compute = Compute(timeout=self.timeout, bank=bank)
            settings = replace(self.settings, seed=seed)
            known = self.stirring, observed, self.prior, compute, settings
            found = fit_recordings(*known, confirm=0, warn=False)
            fit = confirmed(found, None, self.stirring, compute, settings, silent)
        return fit.sample(seed=seed, **SAMPLING), fit.log_prob


@dataclass(frozen=True)
class FromBank:
    """`calibrate` by the emulator of the inclination, with simulations that were made before.

    The engine asks where to simulate; the nearest point that has a run left is told in its place.
    So many calibrations share one set of simulations, and each still learns most where its own
    data lead.

    Attributes:
        stirring: How two signals are compared.
        prior: Of the parameters.
        theta: Points of the set [n, d].
        signals: Of their runs [n, RUNS_PER_POINT, T, 2].
        settings: Of a calibration.
        noise: Of what is observed; None is estimated.
    """

    stirring: StirSimulator
    prior: "Prior"
    theta: NDArray[np.float64]
    signals: NDArray[np.float64]
    settings: CalibrationSettings
    noise: "SumOfNoises | None" = None

    def __call__(self, observed: NDArray, seed: int) -> "tuple[DataTree, Any]":
        from ..inference import Bolfi

        u = self.prior.to_unit(self.prior.to_dict(self.theta))
        left = np.asarray(np.isfinite(self.signals).all(axis=(2, 3)))
        options = engine_options(self.stirring, self.settings.surrogate)
        told: list[tuple[int, int]] = []  # point and run

        def engine(seed: int) -> Bolfi:
            """An engine that was told all so far, with no point outstanding."""
            made = Bolfi(self.prior, observed, seed=seed, noise=self.noise, **options)
            if told:
                point, run = np.array(told).T
                theta = self.prior.to_dict(self.theta[point])
                made.tell(theta, self.signals[point, run], RUNS_PER_POINT * point + run)
            return made

        while len(told) < self.settings.budget:
            # a new engine of the same seed would draw the same random numbers for every batch
            (own,) = simulation_seeds(seed, Phase.SBC_SEARCH, 1, len(told))
            asking = engine(seed if not told else own)
            wanted = asking.initial if not told else self.settings.batch
            asked = asking.ask(min(wanted, self.settings.budget - len(told)))
            told += _nearest(self.prior.to_unit(asked), u, left)
        fit = engine(seed).fit(warn=False)
        return fit.sample(seed=seed, **SAMPLING), fit.log_prob


def _nearest(asked: NDArray, points: NDArray, left: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Point and run for each u asked [n, d].

    What is given is no longer `left` [points, RUNS_PER_POINT].
    """
    for u in asked:
        if not left.any():
            raise RuntimeError("every run of the shared set was told; make it larger")
        apart = np.where(left.any(axis=1), np.sum((points - u) ** 2, axis=1), np.inf)
        point = int(np.argmin(apart))
        run = int(np.argmax(left[point]))
        left[point, run] = False
        yield point, run
