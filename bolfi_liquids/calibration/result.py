"""What stirring taught: the posterior of a run and what came with it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ..errors import InputError
from ..inputs.prior import read_prior
from ..inputs.settings import CalibrationSettings
from ..run.directory import POSTERIOR, read_run
from ..run.summary import read_summary
from .draws import pick_draws
from .summary import CalibrationSummary

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from ..inference import Prior

OPTIONS = ("budget", "surrogate", "sampler", "seed", "particles", "batch")  # of the command


@dataclass(frozen=True, eq=False)
class Calibration:
    """A finished calibration; everything that pours and reports need, without simulating.

    Attributes:
        path: The RUN directory.
        tree: posterior.nc, in ArviZ's schema; the groups are listed in `results`.
        record: run.toml: settings, versions, seed and hashes.
        summary: The section "calibrate" of summary.json.
    """

    path: Path
    tree: "DataTree"
    record: Mapping[str, Any]
    summary: CalibrationSummary

    @classmethod
    def open(cls, run: str | Path) -> "Calibration":
        """Read a finished calibration.

        Raises:
            InputError: There is none in the directory, or it was not finished.
        """
        from .tree import read_tree

        run = Path(run)
        record = read_run(run)
        if not is_calibrated(run):
            raise InputError(
                "the calibration in it is not finished",
                where=str(run),
                fix=f"go on with it: bolfi-liquids calibrate RECORDING... --out {run} --resume"
                + _given_options(record),
            )
        loaded = read_tree(
            run / POSTERIOR, fix="delete it and go on with --resume: no simulation is lost"
        )
        return cls(run, loaded, MappingProxyType(record), CalibrationSummary.read(run))

    @property
    def posterior(self) -> "Dataset":
        """Draws of each parameter, shape (chain, draw)."""
        return self.tree["posterior"].to_dataset()

    @property
    def best(self) -> dict[str, float]:
        """The paper's theta*: the parameters at which the surrogate expects the best fit."""
        return dict(self.summary.best)

    @property
    def prior(self) -> "Prior":
        """Of the parameters."""
        return read_prior(self.record["settings"]["prior"])

    @property
    def liquid_density(self) -> float:
        """Density of the stirred liquid, as weighed [kg/m3]."""
        return float(self.tree.attrs["liquid_density"])

    def draws(self, count: int, seed: int = 0) -> dict[str, NDArray]:
        """A stratified sample of the posterior: parameter -> values, shape (count,)."""
        return pick_draws(self.posterior, count, seed)


def _given_options(record: Mapping[str, Any]) -> str:
    """Options of `calibrate` with which a run was started, where they are not the default."""
    settings, usual = record.get("settings", {}), asdict(CalibrationSettings())
    given = {name: settings.get(name, usual[name]) for name in OPTIONS}
    return "".join(f" --{name} {value}" for name, value in given.items() if value != usual[name])


def is_calibrated(run: Path) -> bool:
    """Whether a run's calibration was finished."""
    return (run / POSTERIOR).is_file() and CalibrationSummary.SECTION in read_summary(run)
