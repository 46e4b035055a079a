"""Expected spillage of any pour of any liquid, within milliseconds.

Choosing a pour by simulation takes a minute. There is no time for that while a robot stirs, so the
pours are simulated beforehand: a space-filling design of liquids and actions, each poured once. A
Gaussian process learns the spilled fraction from them, and a table of its predictions gives the
expected spillage over a posterior.

With 512 pours the map of the bundled cups predicts left-out pours with an error of 0.025 RMS, of
0.015 where little is spilled. The pours take some three minutes on one core, the first time: they
are kept in a simulation bank, under an identity of cups, density and the model's version.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..inputs.prior import PARAMETERS
from ..progress import progress_bar
from ..seeds import Phase, generator, simulation_seeds
from .spillage import ACTION, normal_scores

if TYPE_CHECKING:
    from ..inference import Prior, SimulationBank
    from ..inference.regression import Regression
    from ..inference.simulations import Job
    from ..models import Cups

DEFAULT_POURS = 512
MIN_POURS = 64  # fewer tell a Gaussian process of four inputs next to nothing
MAP_PACKINGS = 64  # initial packings of the pours; a new one takes as long as a quick pour
AT_ONCE = 16  # pours of similar duration in one call
LEFT_OUT = 8  # one pour in so many is left out to check the map by
LIQUID_GRID = 33, 5  # viscosity and cohesion, which acts slowly
ACTION_GRID = 16  # along each axis
LITTLE_SPILLED = 0.1  # spilled fraction below which a pour counts as one that spills little
OUTCOMES_EACH = 16  # equally probable ones of each predicted pour


class MapError(NamedTuple):
    """Errors of the map on pours that it was not made from.

    Attributes:
        rms: Of the spilled fraction.
        rms_little: The same where less than a tenth was expected to be spilled.
        spread: RMS error in units of the predicted standard deviation; 1 if predicted standard
            deviations are calibrated.
        pours: Left out for this check.
    """

    rms: float
    rms_little: float
    spread: float
    pours: int


class Expected(NamedTuple):
    """An action, and what it spills over a posterior.

    Attributes:
        angular_velocity: [rad/s].
        distance: [m].
        spillage: Mean spilled fraction.
        spillage_q95: Spilled fraction that one outcome in twenty exceeds at most; chance between
            pours counts, and so does the map's own error.
    """

    angular_velocity: float
    distance: float
    spillage: float
    spillage_q95: float


@dataclass(frozen=True, eq=False)
class SpillageMap:
    """Predicted spillage over a grid of liquids and actions; see `make_map`.

    Attributes:
        prior: Of the liquid.
        axes: Prior quantiles of the grid's liquids, shapes (V,) and (C,).
        actions: Angular velocity [rad/s] and distance [m] of the grid's actions, shape (A, 2).
        moments: Mean and sd of the transformed spillage, shape (V, C, 2, A).
        inverse: From the transformed to the spilled fraction.
        error: Of pours that were left out.
    """

    prior: "Prior"
    axes: tuple[NDArray[np.float64], NDArray[np.float64]]
    actions: NDArray[np.float64]
    moments: NDArray[np.float64]
    inverse: Callable[[NDArray], NDArray]
    error: MapError

    def outcomes(self, liquids: Mapping[str, NDArray]) -> NDArray[np.float64]:
        """Equally probable spilled fractions (draws * OUTCOMES_EACH, A) of every action.

        Args:
            liquids: Posterior draws of viscosity [Pa s] and cohesion, shape (draws,).
        """
        from scipy.interpolate import RegularGridInterpolator

        u = self.prior.to_unit(liquids)
        mean, sd = np.moveaxis(RegularGridInterpolator(self.axes, self.moments)(u), 1, 0)
        predicted = mean[:, None] + sd[:, None] * normal_scores(OUTCOMES_EACH)[:, None]
        return _fraction(self.inverse, predicted).reshape(-1, len(self.actions))

    def best(self, liquids: Mapping[str, NDArray]) -> Expected:
        """The action of the grid that is expected to spill least.

        The minimum is biased low, because it tends to lie where the map underestimates. So
        `error.rms_little` is added to the bound of the outcomes.
        """
        outcomes = self.outcomes(liquids)
        at = int(np.argmin(outcomes.mean(axis=0)))
        rate, distance = self.actions[at]
        spilled = outcomes[:, at]
        bound = min(1.0, float(np.quantile(spilled, 0.95)) + self.error.rms_little)
        return Expected(float(rate), float(distance), float(spilled.mean()), bound)


def make_pours(
    cups: "Cups",
    density: float,
    bank: "SimulationBank",
    *,
    prior: "Prior",
    pours: int = DEFAULT_POURS,
    progress: bool = True,
) -> tuple[dict[str, NDArray], NDArray[np.float64]]:
    """The pours that a map is learned from; those in the bank are not made again.

    Args:
        cups: Source, receiver and ranges of the action.
        density: Of the liquid [kg/m3].
        bank: Where pours are taken from and put.
        prior: Of viscosity and cohesion.
        pours: How many.
        progress: Whether to show a bar on stderr.

    Returns:
        Parameters of liquid and action, name -> (pours,), and spilled fractions (pours,), NaN
        where a pour failed.

    Raises:
        InputError: `pours` is too small.
    """
    from ..inference.simulations import Keep, columns, run_missing, stacked

    if pours < MIN_POURS:
        raise InputError(f"{pours}", where="pours", fix=f"give at least {MIN_POURS}")
    jobs = _jobs(_joint(prior, cups), pours)

    def simulate(theta: dict[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        from .. import models

        liquid = models.Liquid(theta["viscosity"], theta["cohesion"], density)
        action = models.PourAction(**{name: theta[name] for name in ACTION})
        return models.pour(liquid, action, cups, seeds).spilled[:, None]

    identity = json.dumps(["spillage map", cups.settings(), density], sort_keys=True)
    missing = sum(bank.get(identity, *job) is None for job in jobs)
    with progress_bar("pours for the map", pours, shown=progress and missing > 0) as advance:
        keep = Keep(bank, identity, AT_ONCE)
        results = run_missing(simulate, jobs, keep, (1,), advance=advance)
    return columns(jobs)[0], stacked(results, (1,))[:, 0]


def make_map(
    cups: "Cups",
    density: float,
    bank: "SimulationBank",
    *,
    prior: "Prior",
    pours: int = DEFAULT_POURS,
    progress: bool = True,
) -> SpillageMap:
    """Learn the spilled fraction from pours; arguments as in `make_pours`.

    One pour in eight is left out first. If a map of the rest has larger errors on them than its
    standard deviations, those of the final map are enlarged by that factor.
    """
    theta, spilled = make_pours(cups, density, bank, prior=prior, pours=pours, progress=progress)
    prior, joint = _liquid(prior), _joint(prior, cups)
    left_out = generator(0, Phase.HELD_BACK_POURS).permutation(pours) % LEFT_OUT == 0
    error = _left_out_error(_learn(joint, theta, spilled, ~left_out), theta, spilled, left_out)
    learned = _learn(joint, theta, spilled, np.ones(pours, bool))
    axes = np.linspace(0.0, 1.0, LIQUID_GRID[0]), np.linspace(0.0, 1.0, LIQUID_GRID[1])
    actions = _action_grid(joint, prior)
    moments = _table(learned, prior, axes, actions)
    moments[:, :, 1] *= max(1.0, error.spread)
    return SpillageMap(prior, axes, actions, moments, learned.transform.inverse, error)


def _liquid(prior: "Prior") -> "Prior":
    """The same with its parameters in the order of the map's axes."""
    from ..inference import Prior

    return Prior({name: prior.distributions[name] for name in PARAMETERS})


def _joint(prior: "Prior", cups: "Cups") -> "Prior":
    """Of the liquid and of the action."""
    import numpyro.distributions as dist

    from ..inference import Prior

    return Prior(
        {
            **_liquid(prior).distributions,
            "angular_velocity": dist.LogUniform(*cups.angular_velocity_range),
            "distance": dist.Uniform(*cups.distance_range),
        }
    )


def _jobs(joint: "Prior", pours: int) -> "list[Job]":
    """A Sobol design in order of angular velocity, so that pours of one call end together."""
    from scipy.stats import qmc

    from ..inference.simulations import jobs

    design = qmc.Sobol(len(joint), rng=generator(0, Phase.MAP_DESIGN)).random_base2(
        int(np.ceil(np.log2(pours)))
    )[:pours]
    theta = joint.from_unit(design)
    seeds = simulation_seeds(0, Phase.MAP_POURS, MAP_PACKINGS)
    made = jobs(theta, [seeds[at % MAP_PACKINGS] for at in range(pours)])
    return [made[at] for at in np.argsort(theta["angular_velocity"], kind="stable")]


def _learn(
    joint: "Prior", theta: Mapping[str, NDArray], spilled: NDArray, chosen: NDArray[np.bool_]
) -> "Regression":
    """A Gaussian process on the root of the spilled fraction.

    It is too smooth near the onset of spilling; left-out pours measure the error.
    """
    from ..inference import regress

    known = {name: values[chosen] for name, values in theta.items()}
    return regress(joint, known, spilled[chosen], transform="sqrt")


def _left_out_error(
    learned: "Regression",
    theta: Mapping[str, NDArray],
    spilled: NDArray,
    left_out: NDArray[np.bool_],
) -> MapError:
    seen = left_out & np.isfinite(spilled)
    mean, sd = learned.predict({name: values[seen] for name, values in theta.items()})
    transform = learned.transform
    expected = _fraction(
        transform.inverse, mean[:, None] + sd[:, None] * normal_scores(OUTCOMES_EACH)
    ).mean(1)
    missed, little = expected - spilled[seen], expected < LITTLE_SPILLED
    spread = np.sqrt(np.mean(((transform(spilled[seen]) - mean) / sd) ** 2))

    def rms(values: NDArray) -> float:
        return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")

    return MapError(rms(missed), rms(missed[little]), float(spread), int(seen.sum()))


def _action_grid(joint: "Prior", prior: "Prior") -> NDArray[np.float64]:
    """(A, 2), regular in the logarithm of the angular velocity and in the distance."""
    quantiles = np.linspace(0.0, 1.0, ACTION_GRID)
    pairs = np.stack(np.meshgrid(quantiles, quantiles, indexing="ij"), -1).reshape(-1, 2)
    u = np.full((len(pairs), len(joint)), 0.5)
    u[:, len(prior) :] = pairs
    theta = joint.from_unit(u)
    return np.column_stack([theta[name] for name in ACTION])


def _table(
    learned: "Regression", prior: "Prior", axes: tuple[NDArray, NDArray], actions: NDArray
) -> NDArray[np.float64]:
    """Predicted moments (V, C, 2, A)."""
    u = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    theta = {name: np.repeat(values, len(actions)) for name, values in prior.from_unit(u).items()}
    theta |= {name: np.tile(actions[:, at], len(u)) for at, name in enumerate(ACTION)}
    moments = np.stack(learned.predict(theta))
    shaped = moments.reshape(2, *(len(axis) for axis in axes), len(actions))
    return np.moveaxis(shaped, 0, 2)


def _fraction(inverse: Callable[[NDArray], NDArray], predicted: NDArray) -> NDArray[np.float64]:
    return np.clip(inverse(np.maximum(predicted, 0.0)), 0.0, 1.0)
