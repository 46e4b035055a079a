"""Results of `check sbc`: sbc.nc, a figure for each surrogate, and what is printed.

Groups of sbc.nc, within one for each surrogate: `replicates`, truths and draws; `sbc`, ranks and
p-values; `coverage`, of central intervals; `regions`, coverage by the truth's place in the prior.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..drawing import new_figure, styled, write_figure
from ..run.results import write_result

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset

    from ..inference.checks import SBC, Coverage, Replicates

RESULTS = "sbc.nc"
INTERVAL_LEVEL = 0.9  # of the intervals whose coverage is given by region
PRIOR_REGIONS = 4  # of equal prior probability


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
        write_figure(_figure(check), out, name)
    tree = DataTree.from_dict(groups)
    tree.attrs["made_with"] = json.dumps(record)
    write_result(tree, out / RESULTS)


def _figure(check: SurrogateCheck) -> "Figure":
    with styled():
        figure = new_figure(9.6, 3.8)
        left, right = figure.subplots(1, 2)
        check.sbc.plot(left)
        check.coverage.plot(right)
    return figure
