"""`check sbc`: is what a calibration concludes true as often as it says?

Truths are drawn from the prior, their stirs simulated with seeds of their own, camera noise is
added, and each is calibrated as a recording would be. The emulator of the inclination learns from
one set of simulations for all of them; the paper's surrogate makes its own for each. Bands and
intervals take replicates as independent, which those that share a set are not quite: another seed
draws another set.
"""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..calibration.stir_simulator import Stirring, stirring_of
from ..inputs.bundled import bundled_recording
from ..inputs.open import open_recordings
from ..inputs.prior import default_prior, describe_prior
from ..inputs.recording import Recording
from ..inputs.settings import (
    MIN_SIMULATIONS,
    PAPER_RULES,
    RUNS_PER_POINT,
    SURROGATES,
    SbcSettings,
)
from ..progress import progress_bar
from ..run.directory import SIMULATIONS, enter_run
from ..run.provenance import LIBRARIES, versions
from ..run.workers import processes
from ..seeds import Phase, generator, simulation_seeds
from .sbc_pipelines import (
    SAMPLING,
    Calibrate,
    CameraNoise,
    FromBank,
)
from .sbc_tree import SurrogateCheck, checked, write_results

if TYPE_CHECKING:
    from ..inference import Prior
    from ..inference.checks import Replicates


AT_ONCE = 16  # stirs in one call


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
        ValueError: Of a surrogate, no replicate finished.
    """
    settings = settings or SbcSettings()
    given = bundled_recording("water") if recording is None else recording
    stirring = stirring_of(open_recordings(given), settings.particles)
    prior, out = default_prior(), Path(out)
    enter_run(out, _record(settings, prior, stirring), resume=True)
    found = {}
    with processes(workers) as pool:
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
    from .. import inference

    calibration = settings.calibration(name)
    if name == "signal":
        shared = stirs_everywhere(stirring, prior, settings, out / SIMULATIONS, pool, progress)
        pipeline: Any = FromBank(stirring, prior, *shared, calibration)
    else:
        pipeline = Calibrate(stirring, prior, calibration)
    return inference.replicates(
        pipeline,
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


def _record(settings: SbcSettings, prior: "Prior", stirring: Stirring) -> Mapping[str, Any]:
    from ..inference.engine_version import ENGINE_VERSION

    return {
        "engine": {"version": ENGINE_VERSION, "initial": MIN_SIMULATIONS, "runs": RUNS_PER_POINT}
        | PAPER_RULES
        | SAMPLING,
        "settings": {k: v for k, v in asdict(settings).items() if k not in ("runs", "sequential")}
        | {"prior": describe_prior(prior)},
        "simulator": stirring.settings,
        "inputs": {"sha256": [recording.hash for recording in stirring.recordings]},
        "versions": versions(LIBRARIES),
    }


def stirs_everywhere(  # noqa: PLR0913  what makes simulations
    stirring: Stirring,
    prior: "Prior",
    settings: SbcSettings,
    path: Path,
    pool: Executor | None,
    progress: bool,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of the prior [n, d] and stirs of each [n, RUNS_PER_POINT, T, 2]; failed: NaN."""
    from scipy.stats import qmc

    from ..inference import SimulationBank
    from ..inference.simulations import Job, run_missing

    u = qmc.Sobol(len(prior), rng=generator(settings.seed, Phase.SBC_DESIGN)).random(
        settings.design
    )
    theta = prior.from_unit(u)
    count = RUNS_PER_POINT * settings.design
    seeds = simulation_seeds(settings.seed, Phase.SBC_STIRS, count)
    jobs = [
        Job({name: float(values[at // RUNS_PER_POINT]) for name, values in theta.items()}, seed)
        for at, seed in enumerate(seeds)
    ]
    with (
        SimulationBank(path) as bank,
        progress_bar("simulating stirs for all", count, shown=progress) as advance,
    ):
        made = run_missing(
            stirring.simulate,
            jobs,
            None,
            bank,
            stirring.identity,
            pool,
            batch=AT_ONCE,
            advance=advance,
        )
    nothing = np.full(stirring.observed.shape, np.nan)
    signals = np.stack([nothing if one.signal is None else one.signal for one in made])
    return prior.to_array(theta), signals.reshape(settings.design, RUNS_PER_POINT, *nothing.shape)
