"""`check sbc`: are posteriors of the whole calibration calibrated?

Truths are drawn from the prior, their stirs simulated with seeds of their own, camera noise is
added, and each is calibrated as a recording would be. The emulator of the inclination learns from
one set of simulations for all of them, and no others confirm it; the paper's surrogate makes its
own for each. Bands and intervals assume independent replicates; those that share simulations are
weakly dependent. Another seed draws another set.

Results are sbc.nc and a figure for each surrogate. Groups of sbc.nc, within one for each surrogate:
`replicates`, truths and draws; `sbc`, ranks and p-values; `coverage`, of central intervals;
`regions`, coverage by the truth's place in the prior.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..calibration.model_error import model_error
from ..calibration.stirs import with_model_error
from ..drawing import new_figure, styled, write_figure
from ..errors import Argument
from ..files import given_path
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
    Surrogate,
)
from ..progress import progress_bar
from ..run.results import versions, write_result
from ..run.run import SIMULATIONS, Run
from ..seeds import Phase, generator, simulation_seeds
from ..simulators import StirSimulator, stir_simulator
from .sbc_pipelines import SAMPLING, Calibrate, FromBank, Observed

if TYPE_CHECKING:
    from xarray import Dataset

    from ..inference import Prior
    from ..inference.checks import SBC, Coverage, Replicates
    from ..inference.simulations import Compute

STIRS_PER_CALL = 16  # of the simulator, where there is no executor
RESULTS = "sbc.nc"
INTERVAL_LEVEL = 0.9  # of the intervals whose coverage is given by region
PRIOR_REGIONS = 4  # of equal prior probability


def check_sbc(
    out: str | Path,
    recording: str | Path | Recording | None = None,
    *,
    settings: SbcSettings | None = None,
    compute: "Compute | None" = None,
    progress: bool = True,
) -> "dict[str, SurrogateCheck]":
    """Simulation-based calibration and coverage of both surrogates with the particle fluid.

    Everything finished is kept in `out` at once; the same call goes on where the last one ended.

    Args:
        out: Directory of results; made if missing.
        recording: Whose gripper path and rig are simulated; None is the bundled stir of water.
        settings: How many of what; None is the default.
        compute: Where simulations run; None is this process.
        progress: Whether to show bars on stderr.

    Returns:
        By the surrogate's name.

    Raises:
        InputError: A recording or setting cannot be used, or `out` holds other results.
        ValueError: Of a surrogate, no replicate finished.
    """
    from ..inference.simulations import Compute

    settings, compute = settings or SbcSettings(), compute or Compute()
    given = bundled_recording("water") if recording is None else recording
    stirring = stir_simulator(open_recordings(given), settings.particles)
    prior, out = default_prior(), given_path(out, Argument("out"))
    record = _record(settings, prior, stirring)
    found = {}
    with Run.begun(out, record, resume=True):
        study = SbcStudy(out, stirring, prior, settings, compute, progress)
        for name in SURROGATES:
            if settings.replicates[name]:
                made = study.replicates(name)
                found[name] = checked(made, conservative=name == "discrepancy")
                write_results(out, found, record)
    return found


def _record(settings: SbcSettings, prior: "Prior", stirring: StirSimulator) -> Mapping[str, Any]:
    from ..inference.engine_version import ENGINE_VERSION

    return {
        "engine": {"version": ENGINE_VERSION, "initial": MIN_SIMULATIONS, "runs": RUNS_PER_POINT}
        | PAPER_RULES
        | SAMPLING,
        "settings": {k: v for k, v in asdict(settings).items() if k not in ("runs", "sequential")}
        | {"prior": describe_prior(prior)},
        "simulator": stirring.settings,
        "inputs": {"sha256": [recording.hash for recording in stirring.recordings]},
        "versions": versions(),
    }


@dataclass(frozen=True)
class SbcStudy:
    """Settings and inputs that the replicates of both surrogates share.

    Attributes:
        out: Directory of results.
        stirring: The simulator.
        prior: Prior of the parameters.
        settings: How many of what.
        compute: Where simulations run.
        progress: Whether to show bars on stderr.
    """

    out: Path
    stirring: StirSimulator
    prior: "Prior"
    settings: SbcSettings
    compute: "Compute"
    progress: bool

    def replicates(self, name: Surrogate) -> "Replicates":
        """Calibrations of stirs whose truths are known, by one of `SURROGATES`."""
        from .. import inference
        from ..inference.criticism import KnownNoise

        calibration = self.settings.calibration(name)
        noise: Any = KnownNoise(float(np.radians(self.settings.noise_deg)))
        pipeline: Any = Calibrate(self.stirring, self.prior, calibration, self.compute.timeout)
        if name == "signal":
            # an error of the simulator is observed, and allowed for, as `calibrate` does
            noise = with_model_error(noise, model_error(self.stirring, 0.0))
            shared = self.stirs_everywhere()
            pipeline = FromBank(self.stirring, self.prior, *shared, calibration, noise)
        return inference.replicates(
            pipeline,
            self.stirring.batched,
            self.prior,
            self.settings.replicates[name],
            seed=self.settings.seed,
            observe=Observed(noise),
            executor=self.compute.executor,
            store=self.out / f"{name}.sqlite",
            identity=self.stirring.identity,
            progress=self.progress,
        )

    def stirs_everywhere(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points that fill the prior, and `RUNS_PER_POINT` stirs of each.

        Returns:
            Points [n, d], and signals [n, RUNS_PER_POINT, T, 2]; NaN for a stir that failed.
        """
        from scipy.stats import qmc

        from ..inference import SimulationBank
        from ..inference.simulations import jobs, run_missing, stacked

        stirring, design = self.stirring, self.settings.design
        rng = generator(self.settings.seed, Phase.SBC_DESIGN)
        u = qmc.Sobol(len(self.prior), rng=rng).random(design)
        theta = self.prior.from_unit(u)
        count = RUNS_PER_POINT * design
        seeds = simulation_seeds(self.settings.seed, Phase.SBC_STIRS, count)
        repeated = {name: np.repeat(values, RUNS_PER_POINT) for name, values in theta.items()}
        with (
            SimulationBank(self.out / SIMULATIONS) as bank,
            progress_bar("simulating stirs for all", count, shown=self.progress) as advance,
        ):
            made = run_missing(
                stirring.batched,
                jobs(repeated, seeds),
                replace(self.compute, batch=STIRS_PER_CALL, bank=bank),
                identity=stirring.identity,
                advance=advance,
            )
        shape = stirring.observed.shape
        signals = stacked(made, shape).reshape(design, RUNS_PER_POINT, *shape)
        return self.prior.to_array(theta), signals


@dataclass(frozen=True, eq=False)
class SurrogateCheck:
    """Ranks and coverage of one surrogate's replicates.

    Attributes:
        replicates: Truths, data and draws.
        sbc: Of all parameters, and of the log density.
        coverage: Of central intervals of the parameters.
        regions: Coverage of 90 % intervals, over (region, quantity).
    """

    replicates: "Replicates"
    sbc: "SBC"
    coverage: "Coverage"
    regions: "Dataset"

    @property
    def ok(self) -> bool:
        """Neither the test of ranks nor that of coverage fails."""
        return self.sbc.ok and self.coverage.ok

    def __str__(self) -> str:
        return "\n\n".join(map(str, (self.sbc, self.coverage)))


def checked(made: "Replicates", *, conservative: bool) -> SurrogateCheck:
    """Ranks, coverage, and where in the prior it fails.

    Args:
        made: The replicates.
        conservative: Of the coverage, only too little is a fault: the paper's likelihood is wide
            by construction. Ranks must be uniform all the same.
    """
    from .. import inference

    covered = inference.coverage(made, conservative=conservative)
    return SurrogateCheck(made, inference.sbc(made), covered, _regions(covered))


def _regions(coverage: "Coverage") -> "Dataset":
    """Coverage by quarters of the prior, from the lowest truths to the highest."""
    from xarray import Dataset

    inside = 2 * np.abs(coverage.quantiles - 0.5) <= INTERVAL_LEVEL
    truths = coverage.replicates.to_dataset()
    names = [name for name in coverage.names if f"{name}_truth" in truths]
    count = min(PRIOR_REGIONS, len(inside))
    rate, upper = np.empty((count, len(names))), np.empty((count, len(names)))
    for j, name in enumerate(names):
        truth = truths[f"{name}_truth"].to_numpy()
        parts = np.array_split(np.argsort(truth, kind="stable"), count)
        column = coverage.names.index(name)
        rate[:, j] = [inside[part, column].mean() for part in parts]
        upper[:, j] = [truth[part].max() for part in parts]
    dims = ("region", "quantity")
    return Dataset({"rate": (dims, rate), "up_to": (dims, upper)}, {"quantity": names})


def write_results(
    out: Path, found: Mapping[str, SurrogateCheck], record: Mapping[str, Any]
) -> None:
    """sbc.nc and the figures, as PNG and SVG."""
    from xarray import DataTree

    groups: dict[str, Dataset] = {}
    for name, check in found.items():
        groups |= {
            f"/{name}/replicates": check.replicates.to_dataset(),
            f"/{name}/sbc": check.sbc.to_dataset(),
            f"/{name}/coverage": check.coverage.to_dataset(),
            f"/{name}/regions": check.regions,
        }
        with styled():
            figure = new_figure(9.6, 3.8)
            left, right = figure.subplots(1, 2)
            check.sbc.plot(left)
            check.coverage.plot(right)
        write_figure(figure, out, name)
    tree = DataTree.from_dict(groups)
    tree.attrs["made_with"] = json.dumps(record)
    write_result(tree, out / RESULTS)
