"""`check sbc`: is what a calibration concludes true as often as it says?

Truths are drawn from the prior, their stirs simulated with seeds of their own, camera noise is
added, and each is calibrated as a recording would be. The emulator of the inclination learns from
one set of simulations for all of them; the paper's surrogate makes its own for each.
"""

import os
import warnings
from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .calibrator import fit_recordings
from .prior import default_prior, describe_prior
from .provenance import LIBRARIES, versions
from .recordings import Recording, open_recording
from .run_directory import SIMULATIONS, enter_run
from .sbc_results import SurrogateCheck, checked, write_results
from .settings import SURROGATES, CalibrationSettings, SbcSettings
from .stirring import Stirring, stirring_of

if TYPE_CHECKING:
    from xarray import DataTree

    from .inference import Prior, Replicates


@dataclass(frozen=True)
class CameraNoise:
    """Independent Gaussian noise in every sample.

    Attributes:
        sd: [rad].
    """

    sd: float

    def __call__(self, signal: NDArray, rng: np.random.Generator) -> NDArray[np.float64]:
        return signal + rng.normal(0.0, self.sd, signal.shape)


@dataclass(frozen=True)
class Calibrate:
    """What `calibrate` makes of a signal, as a pipeline of `inference.replicates`.

    Attributes:
        stirring: The simulator; its recording's inclination is not looked at.
        prior: Of the parameters.
        settings: Budget, surrogate and sampler; the seed is each replicate's.
    """

    stirring: Stirring
    prior: "Prior"
    settings: CalibrationSettings

    def __call__(self, observed: NDArray, seed: int) -> "tuple[DataTree, Any]":
        from .inference import SimulationBank
        from .kept import Keep

        with SimulationBank(":memory:") as bank:
            keep = Keep(bank, self.stirring.identity, self.settings.batch)
            fit = fit_recordings(
                self.stirring,
                observed,
                self.prior,
                keep,
                budget=self.settings.budget,
                surrogate=self.settings.surrogate,
                seed=seed,
            )
        return fit.sample(seed=seed, **_sampling(self.settings)), fit.log_prob


@dataclass(frozen=True)
class Quietly:
    """A pipeline whose emulator's complaints are not repeated for every replicate.

    Attributes:
        pipeline: See `inference.replicates`.
    """

    pipeline: Any

    def __call__(self, observed: NDArray, seed: int) -> "tuple[DataTree, Any]":
        from .inference import EmulatorWarning

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", EmulatorWarning)
            return self.pipeline(observed, seed)


def check_sbc(
    out: str | Path,
    recording: str | Path | Recording | None = None,
    *,
    settings: SbcSettings | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> dict[str, SurrogateCheck]:
    """Simulation-based calibration and coverage of both surrogates with the particle fluid.

    Everything finished is kept in `out` at once; the same call goes on where the last one ended.

    Args:
        out: Directory of results; made if missing.
        recording: Whose gripper path and rig are simulated; None is the bundled stir of water.
        settings: How many of what; None is the default.
        workers: Processes that share the work; None is one for each processor.
        progress: Show bars on stderr.

    Returns:
        By the surrogate's name.

    Raises:
        InputError: A recording or setting cannot be used, or `out` holds other results.
        RuntimeError: Of a surrogate, no replicate finished.
    """
    settings = settings or SbcSettings()
    opened = _opened(recording)
    stirring = stirring_of([opened], settings.particles)
    prior, out = default_prior(), Path(out)
    enter_run(out, _record(settings, prior, stirring), resume=True)
    found = {}
    with _processes(workers) as pool:
        for name in SURROGATES:
            count = settings.replicates[name]
            if count:
                made = _replicates(name, count, out, stirring, prior, settings, pool, progress)
                found[name] = checked(made, conservative=name == "discrepancy")
                write_results(out, found, _record(settings, prior, stirring))
    return found


def _replicates(  # noqa: PLR0913  what the two surrogates share
    name: str,
    count: int,
    out: Path,
    stirring: Stirring,
    prior: "Prior",
    settings: SbcSettings,
    pool: Executor | None,
    progress: bool,
) -> "Replicates":
    from . import inference

    calibration = settings.calibration(name)
    if name == "signal":
        pipeline: Any = inference.shared_design(
            stirring.simulate,
            prior,
            settings.design,
            seed=settings.seed,
            options={"surrogate": name},
            sampling=_sampling(calibration),
            executor=pool,
            bank=out / SIMULATIONS,
            identity=stirring.identity,
        )
    else:
        pipeline = Calibrate(stirring, prior, calibration)
    return inference.replicates(
        Quietly(pipeline),
        stirring.simulate,
        prior,
        count,
        seed=settings.seed,
        observe=CameraNoise(np.radians(settings.noise_deg)),
        executor=pool,
        store=out / f"{name}.sqlite",
        identity=stirring.identity,
        progress=progress,
    )


def _sampling(settings: CalibrationSettings) -> dict[str, Any]:
    return {"sampler": settings.sampler, "chains": settings.chains, "draws": settings.draws}


def _opened(recording: str | Path | Recording | None) -> Recording:
    if isinstance(recording, Recording):
        return recording
    if recording is not None:
        return open_recording(recording)
    from importlib.resources import as_file, files

    with as_file(files("bolfi_liquids.data") / "water_v10.nc") as path:
        return open_recording(path)


def _record(settings: SbcSettings, prior: "Prior", stirring: Stirring) -> Mapping[str, Any]:
    return {
        "settings": {k: v for k, v in asdict(settings).items() if k not in ("runs", "sequential")}
        | {"prior": describe_prior(prior)},
        "simulator": stirring.settings,
        "inputs": {"sha256": [recording.hash for recording in stirring.recordings]},
        "versions": versions(LIBRARIES),
    }


def _processes(workers: int | None) -> "AbstractContextManager[Executor | None]":
    """None for one worker: this process."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    count = workers or os.cpu_count() or 1
    if count == 1:
        return nullcontext()
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))
