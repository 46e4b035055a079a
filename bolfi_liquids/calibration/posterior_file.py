"""posterior.nc: the engine's tree and what reports and pours need beside it.

Groups from the engine, in ArviZ's schema: `posterior`, `sample_stats`, `prior`,
`observed_data`, `constant_data`, `simulations`. Added here:

- `recorded`: inclination over (frame, plane), with `time`, `recording` and `stroke` of each
  frame;
- `posterior_predictive`: inclination over (chain, draw, frame, plane), fresh seeds;
- `replicates`: inclination over (seed, frame, plane), at theta*;
- `closest`: inclination over (frame, plane), discrepancy and parameters of the simulation at a
  posterior draw that came nearest;
- `surface`: over a grid of prior quantiles, the log densities of prior and posterior.
"""

from typing import TYPE_CHECKING

import numpy as np

from ..inputs.recording import PLANE_NAMES
from ..inputs.strokes import stroke_numbers
from ..models.numerics import cells_in_radius
from ..simulators import StirSimulator
from .engine_fit import PosteriorCheck

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from ..inference import Fit

GRID_POINTS = 61  # of either half of an axis


def results_tree(
    sampled: "DataTree", fit: "Fit", stirring: StirSimulator, check: PosteriorCheck
) -> "DataTree":
    """The engine's tree with the groups of this module."""
    from xarray import Dataset, DataTree

    frames = {
        "time": ("frame", stirring.time, {"units": "s"}),
        "recording": ("frame", stirring.member),
        "stroke": ("frame", np.concatenate([stroke_numbers(r) for r in stirring.recordings])),
        "plane": list(PLANE_NAMES),
    }

    def inclination(values, *leading: str) -> Dataset:
        dims = (*leading, "frame", "plane")
        return Dataset({"inclination": (dims, values, {"units": "rad"})}, coords=frames)

    tree = sampled.copy()
    numbers = {"discrepancy": check.closest.discrepancy, **check.closest.theta}
    closest = inclination(check.closest.signal).assign(numbers)
    added = {
        "recorded": inclination(stirring.observed),
        "posterior_predictive": inclination(check.predictive[None], "chain", "draw"),
        "replicates": inclination(check.replicates, "seed"),
        "closest": closest,
        "surface": surface(fit),
    }
    for name, dataset in added.items():
        tree[name] = DataTree(dataset)
    tree.attrs["seconds_simulator"] += check.seconds
    tree.attrs["least_viscosity"] = stirring.least_viscosity
    tree.attrs["stick_radius_cells"] = [
        cells_in_radius(setup.stick.radius, setup.cell) for setup in stirring.setups
    ]
    tree.attrs["liquid_density"] = stirring.recordings[0].number("liquid_density")
    return tree


def surface(fit: "Fit") -> "Dataset":
    """Prior and posterior over a grid; half of each axis are quantiles of the prior, half of the
    posterior, which may be narrow.

    Returns:
        Over (viscosity, cohesion), or whichever two parameters: `log_prior` and
        `log_posterior`, densities in natural units, the latter up to a constant.
    """
    from xarray import Dataset

    names = fit.prior.names
    axes = _axes(fit)
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    theta = {name: values.ravel() for name, values in zip(names, mesh, strict=True)}
    columns = {
        "log_prior": fit.prior.log_prob(theta),
        "log_posterior": fit.log_prob(theta),
    }
    shape = mesh[0].shape
    return Dataset(
        {name: (names, np.reshape(values, shape)) for name, values in columns.items()},
        coords=axes,
    )


def _axes(fit: "Fit") -> dict[str, np.ndarray]:
    from scipy.special import ndtr

    from ..inference.sampling.importance import weighted_quantiles

    shares, population = np.linspace(0.0, 1.0, GRID_POINTS), fit.population
    even = fit.prior.from_unit(np.repeat(shares[:, None], len(fit.prior), axis=1))
    theta = fit.prior.from_unit(ndtr(population.x))
    near = {n: weighted_quantiles(theta[n], population.weights, list(shares)) for n in theta}
    return {name: np.union1d(even[name], near[name]) for name in even}
