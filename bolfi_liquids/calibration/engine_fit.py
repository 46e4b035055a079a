"""The engine's fit of recordings, simulations that confirm and judge it, and posterior.nc.

Groups of posterior.nc from the engine, in ArviZ's schema: `posterior`, `sample_stats`, `prior`,
`observed_data`, `constant_data`, `simulations`. Added here:

- `recorded`: inclination over (frame, plane), with `time`, `recording` and `stroke` of each
  frame;
- `posterior_predictive`: inclination over (chain, draw, frame, plane), fresh seeds;
- `replicates`: inclination over (seed, frame, plane), at theta*;
- `closest`: inclination over (frame, plane), discrepancy and parameters of the simulation at a
  posterior draw that came nearest;
- `surface`: over a grid of prior quantiles, the log densities of prior and posterior.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..inputs.recording import PLANE_NAMES
from ..inputs.settings import MIN_SIMULATIONS, PAPER_RULES, CalibrationSettings
from ..inputs.strokes import stroke_numbers
from ..models.numerics import cells_in_radius
from ..progress import Advance, silent
from ..run.simulations import simulate_kept
from ..seeds import Phase, simulation_seeds
from ..simulators import StirSimulator

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from ..inference import Fit, Prior
    from ..inference.criticism import Noise
    from ..inference.result import Closest
    from ..inference.simulations import Compute

PREDICTIVE_DRAWS = 8
QUICK_DRAWS = 500  # of each of two chains
NOT_KEPT = ["log_likelihood", "log_prior", "prior_predictive"]  # tens of megabytes, or no use alone
THETA_STAR_REPLICATES = 4  # seeds at theta*, for the noise between seeds
GRID_POINTS = 61  # of either half of an axis of the surface
GRID_SCORES = 3.5  # normal score of the posterior's last quantile on it, to either side


def fit_recordings(
    stirring: StirSimulator,
    observed: NDArray,
    prior: "Prior",
    compute: "Compute",
    settings: CalibrationSettings,
    **more: Any,
) -> "Fit":
    """The engine's fit of a stir, with the options that go with the surrogate.

    Args:
        stirring: The simulator, and how two signals are compared.
        observed: Inclinations (T, 2) [rad], NaN where missing.
        prior: Prior of the parameters.
        compute: Where simulations are made and kept.
        settings: Budget, surrogate and seed.
        more: Other arguments of `inference.fit`, and `budget` in place of the settings'; those
            that are None are left out, and without `progress` no bar is shown.
    """
    from .. import inference

    given = {name: value for name, value in more.items() if value is not None}
    options = engine_options(stirring, settings.surrogate)
    if "initial" in options:
        options["initial"] = min(options["initial"], settings.budget)
    return inference.fit(
        stirring.batched,
        prior,
        observed,
        batch=settings.batch,
        seed=settings.seed,
        executor=compute.executor,
        in_rounds=True,
        bank=":memory:" if compute.bank is None else compute.bank,
        identity=stirring.identity,
        timeout=compute.timeout,
        **{"budget": settings.budget, "progress": False, **given},
        **options,
    )


def engine_options(stirring: StirSimulator, surrogate: str) -> dict[str, Any]:
    """Options of `inference.Bolfi` that go with one of `settings.SURROGATES`."""
    paper = {**PAPER_RULES, "initial": MIN_SIMULATIONS}
    return {
        "surrogate": surrogate,
        "discrepancy": stirring.discrepancy(),
        **(paper if surrogate == "discrepancy" else {}),
    }


def quick_draws(fit: "Fit", seed: int) -> "Dataset":
    """Draws of a fit's posterior by quadrature, within seconds, shape (chain, draw)."""
    tree = fit.sample("quadrature", chains=2, draws=QUICK_DRAWS, seed=seed, warn=False)
    return tree["posterior"].to_dataset()


def confirmed(
    fit: "Fit",
    noise: "Noise | None",
    stirring: StirSimulator,
    compute: "Compute",
    settings: CalibrationSettings,
    advance: Advance,
) -> "Fit":
    """Refit beside the simulator's error, with runs at draws of the posterior.

    Args:
        fit: Of the search, beside another error.
        noise: Of the cameras and of the simulator; None where the surrogate allows for none.
        stirring: What was simulated.
        compute: Where simulations are made and kept.
        settings: Of the run.
        advance: Called with 1 for each simulation.

    Warns:
        EmulatorWarning: For each complaint.
    """
    from ..inference.criticism import Experiment

    observed, search = fit.observed, fit.history
    if noise is not None:
        observed = Experiment(stirring.batched, observed, noise).corrected
    made = fit_recordings(
        stirring,
        observed,
        fit.prior,
        compute,
        settings,
        budget=0,
        earlier=(
            fit.prior.to_dict(search.theta),
            search.signals,
            search.seeds,
            search.why.tolist(),
        ),
        confirm=PREDICTIVE_DRAWS,
        progress=advance,
        noise=noise,
    )
    # the rounds that the search asked in, and what was recorded before it was corrected
    later = made.history.rounds[len(search.rounds) :] + search.rounds.max() + 1
    rounds = np.append(search.rounds, later)
    return replace(
        made,
        observed=fit.observed,
        history=made.history._replace(rounds=rounds),
        seconds={part: spent + made.seconds[part] for part, spent in fit.seconds.items()},
        made_by=None,  # of the corrected data
    )


def closest_drawn(fit: "Fit", stirring: StirSimulator) -> "tuple[Closest, NDArray[np.int64]]":
    """The run at a posterior draw that comes closest, and all of them that succeeded, as rows (n,).

    It judges the fit, not the closest run of the search: among few of these none may be near,
    though the posterior is right.

    Raises:
        RuntimeError: Every simulation at a posterior draw failed.
    """
    from ..inference.result import Closest

    drawn, history = fit.confirming, fit.history
    good = drawn[history.succeeded[drawn]]
    if not good.size:
        raise RuntimeError(
            f"all {len(drawn)} simulations at draws of the posterior failed, the first:"
            f" {history.errors[drawn[0]]}; repeat the call with a larger budget"
        )
    distance = stirring.discrepancy()
    discrepancies = [distance(stirring.observed, history.signal(run)) for run in good]
    nearest = int(np.argmin(discrepancies))
    theta = fit.prior.to_dict(history.theta[good[nearest]])
    named = {name: float(value) for name, value in theta.items()}
    return Closest(named, history.signal(good[nearest]), discrepancies[nearest]), good


def results_tree(
    sampled: "DataTree",
    fit: "Fit",
    stirring: StirSimulator,
    seed: int,
    compute: "Compute",
    advance: Advance = silent,
) -> "DataTree":
    """The engine's tree with the groups that are added here; simulates the replicates.

    Args:
        sampled: Of the engine.
        fit: That was sampled, with runs that confirm it or not.
        stirring: The simulator, and what was recorded.
        seed: Of the run.
        compute: Where simulations are made and kept.
        advance: Called with 1 for each simulation.

    Raises:
        RuntimeError: Every simulation at a posterior draw failed, or every one at theta*.
    """
    from xarray import Dataset, DataTree

    closest, good = closest_drawn(fit, stirring)
    at_best = {name: np.full(THETA_STAR_REPLICATES, value) for name, value in fit.best.items()}
    seeds = simulation_seeds(seed, Phase.REPLICATES, THETA_STAR_REPLICATES)
    replicates = simulate_kept(
        stirring, at_best, seeds, compute, advance=advance, before=fit.history.why.tolist()
    )
    frames = {
        "time": ("frame", stirring.time, {"units": "s"}),
        "recording": ("frame", stirring.member),
        "stroke": ("frame", np.concatenate([stroke_numbers(r) for r in stirring.recordings])),
        "plane": list(PLANE_NAMES),
    }

    def inclination(values, *leading: str) -> Dataset:
        dims = (*leading, "frame", "plane")
        return Dataset({"inclination": (dims, values, {"units": "rad"})}, coords=frames)

    tree = sampled.drop_nodes(NOT_KEPT, errors="ignore")
    numbers = {"discrepancy": closest.discrepancy, **closest.theta}
    added = {
        "recorded": inclination(stirring.observed),
        "posterior_predictive": inclination(fit.history.signals[good][None], "chain", "draw"),
        "replicates": inclination(replicates.signals, "seed"),
        "closest": inclination(closest.signal).assign(numbers),
        "surface": _surface(fit),
    }
    for name, dataset in added.items():
        tree[name] = DataTree(dataset)
    tree.attrs["seconds_simulator"] += replicates.seconds
    tree.attrs["least_viscosity"] = stirring.least_viscosity
    tree.attrs["stick_radius_cells"] = [
        cells_in_radius(setup.stick.radius, setup.cell) for setup in stirring.setups
    ]
    tree.attrs["liquid_density"] = stirring.recordings[0].number("liquid_density")
    return tree


def _surface(fit: "Fit") -> "Dataset":
    """Prior and posterior over a grid; half of each axis are quantiles of the prior, half of the
    posterior, which may be narrow.

    Returns:
        Over (viscosity, cohesion), or whichever two parameters: `log_prior` and
        `log_posterior`, densities in natural units, the latter up to a constant.
    """
    from scipy.special import ndtr
    from xarray import Dataset

    from ..inference.sampling.importance import weighted_quantiles

    prior, population = fit.prior, fit.population
    shares = np.linspace(0.0, 1.0, GRID_POINTS)
    even = prior.from_unit(np.repeat(shares[:, None], len(prior), axis=1))
    # even in normal scores, so that the tails of a narrow posterior are resolved, too
    tailed = ndtr(np.linspace(-GRID_SCORES, GRID_SCORES, GRID_POINTS))
    drawn = prior.from_unit(ndtr(population.x))
    axes = {
        name: np.union1d(even[name], weighted_quantiles(values, population.weights, list(tailed)))
        for name, values in drawn.items()
    }
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    theta = {name: values.ravel() for name, values in zip(axes, mesh, strict=True)}
    columns = {"log_prior": prior.log_prob(theta), "log_posterior": fit.log_prob(theta)}
    return Dataset(
        {name: (tuple(axes), np.reshape(of, mesh[0].shape)) for name, of in columns.items()},
        coords=axes,
    )
