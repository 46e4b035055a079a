"""The result of a calibration."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..drawing import shown
from ..inference.notebook_display import html_table
from ..run.run import Run, RunOrPath, key_of
from ..seeds import Phase, generator
from .figures import draw_fit, draw_posterior, draw_search
from .summary import CalibrationSummary, bad_fit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike
    from xarray import Dataset, DataTree

    from ..inference import Prior


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """A finished calibration; nothing here simulates.

    The plots draw in `axes`, where they are given, or else in a figure of their own.

    Attributes:
        run: What it was made from.
        tree: posterior.nc, in ArviZ's schema; groups as in `calibration.engine_fit`.
        summary: The section "calibrate" of summary.json.
    """

    run: Run
    tree: "DataTree"
    summary: CalibrationSummary

    def __repr__(self) -> str:
        parameters = self.summary.parameters.items()
        rows = ", ".join(f"{name} {of.interval(name)}" for name, of in parameters)
        fit = "" if bad_fit(self.summary) is None else f", fit {self.summary.fit_status}"
        return f"Calibration({str(self.path)!r}: {rows}; {self.summary.sampler_status}{fit})"

    def _repr_html_(self) -> str:
        status = self.summary.sampler_status
        parameters = {name: of.interval(name) for name, of in self.summary.parameters.items()}
        rows = {"run": self.path, **parameters, "sampler": status, "next": status.advice}
        if (bad := bad_fit(self.summary)) is not None:
            rows["warning"] = bad
        return html_table("Calibration", rows.items())

    @classmethod
    def open(cls, run: RunOrPath) -> "Calibration":
        """Read a finished calibration.

        Raises:
            InputError: There is none in the directory, or it was not finished.
        """
        return cls.of(Run.open(run))

    @classmethod
    def of(cls, run: Run) -> "Calibration":
        """The calibration of a run, without what a criticism accepted.

        Raises:
            InputError: It is not finished, or its settings are others now.
        """
        tree = run.required("calibrate")
        summary = CalibrationSummary.from_json(json.loads(tree.attrs["summary"]))
        return cls(run, tree, summary)

    @property
    def path(self) -> Path:
        """The RUN directory."""
        return self.run.path

    @property
    def record(self) -> Mapping[str, Any]:
        """run.toml: settings, versions, seed and hashes."""
        return self.run.record

    @property
    def key(self) -> str:
        """Digest of the posterior's draws, as they are now."""
        return key_of(self.tree)

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
        """Prior of the parameters."""
        return self.run.prior

    @property
    def learned_from(self) -> tuple[dict[str, NDArray], NDArray, NDArray]:
        """Simulations that succeeded: parameters (n,), signals (n, T, 2) [rad], seeds (n,)."""
        made = self.tree["simulations"].to_dataset()
        good = ~made["failed"].to_numpy()
        theta = {name: made[name].to_numpy()[good] for name in self.prior.names}
        return theta, made["signal"].to_numpy()[good], made["seed"].to_numpy()[good]

    @property
    def added(self) -> tuple[str, ...]:
        """Effects that a criticism has added to the liquid's parameters."""
        searched = self.tree["simulations"].to_dataset()
        return tuple(str(name) for name in self.posterior.data_vars if name not in searched)

    @property
    def liquid_density(self) -> float:
        """Density of the stirred liquid, as weighed [kg/m3]."""
        return float(self.tree.attrs["liquid_density"])

    def plot_fit(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Inclination against time: recorded, closest simulation and posterior predictions.

        Args:
            axes: Where to draw, one row for each recording and one column for each plane.

        Returns:
            The axes.

        Raises:
            ValueError: A criticism has added effects; there is no such plot with them.
        """
        self._check_plot("plot_residuals")
        return shown(partial(draw_fit, self.tree), axes)

    def plot_posterior(self, ax: "Axes | None" = None) -> "NDArray[Any]":
        """Contours of the joint posterior; in a figure of its own with the marginals.

        Args:
            ax: Where to draw the contours alone.

        Returns:
            The axes.

        Raises:
            ValueError: A criticism has added effects; there is no such plot with them.
        """
        self._check_plot("plot_coefficient")
        return shown(partial(draw_posterior, self.tree), ax)

    def plot_search(self, axes: "ArrayLike | None" = None) -> "NDArray[Any]":
        """Discrepancy of each simulation in turn, and the parameters that it tried.

        Args:
            axes: Where to draw, one for the discrepancy and one for each parameter.

        Returns:
            The axes.
        """
        return shown(partial(draw_search, self.tree), axes)

    def _check_plot(self, instead: str) -> None:
        """Refuse to plot the model that lacks what a criticism added."""
        if self.added:
            raise ValueError(
                f"the plot would be of the model without {', '.join(self.added)}; use "
                f"`criticism.{instead}()`, or plot `criticism.base`"
            )

    def draws(self, count: int, seed: int = 0) -> dict[str, NDArray]:
        """A stratified sample of the posterior: parameter -> values, shape (count,)."""
        return pick_draws(self.posterior, count, seed)


def pick_draws(posterior: "Dataset", count: int, seed: int) -> dict[str, NDArray[np.float64]]:
    """A stratified sample of a posterior.

    The draws are ordered by the first parameter and cut into `count` equal strata, with one
    draw at random from each: as unbiased as `count` independent draws, with less variance.

    Args:
        posterior: Variables of shape (chain, draw).
        count: How many draws, at most as many as there are.
        seed: Decides which.

    Returns:
        Parameter -> values, shape (count,).

    Raises:
        ValueError: More draws were asked for than there are.
    """
    flat = {str(name): values.to_numpy().ravel() for name, values in posterior.items()}
    first = next(iter(flat.values()))
    if not 1 <= count <= first.size:
        raise ValueError(f"draws must be from 1 to {first.size}, got {count}")
    rng = generator(seed, Phase.POSTERIOR_DRAWS)
    strata = np.array_split(np.argsort(first, kind="stable"), count)
    chosen = np.array([rng.choice(stratum) for stratum in strata])
    return {name: values[chosen] for name, values in flat.items()}
