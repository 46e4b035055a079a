"""Calibrating a liquid whose parameters are known: by stirring it, and by pouring it.

Both are simulators for `run_missing` of the engine, which keeps what is finished. They map a truth
to theta* and posterior draws with each budget.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bolfi_liquids.inference import Bolfi, Fit, Prior, SimulationBank, engine_version
from bolfi_liquids.inference.criticism import KnownNoise
from bolfi_liquids.inference.simulations import Compute
from bolfi_liquids.inference.types import Simulator
from bolfi_liquids.models import Cups
from numpy.typing import NDArray

from bolfi_liquids import models
from bolfi_liquids.calibration.engine_fit import engine_options
from bolfi_liquids.calibration.result import pick_draws
from bolfi_liquids.checks.sbc_pipelines import SAMPLING, Observed
from bolfi_liquids.inputs.prior import describe_prior
from bolfi_liquids.inputs.settings import MIN_SIMULATIONS, PAPER_RULES
from bolfi_liquids.seeds import generator
from bolfi_liquids.simulators import FluidSimulator, StirSimulator

from .kept_simulator import keeping
from .phases import Phase
from .truths import DENSITY

DRAWS_EACH = 16  # of each posterior
BATCH = 4  # simulations at the same time
CAMERA_NOISE_SD = float(np.radians(0.1))
CAMERA_NOISE = Observed(KnownNoise(CAMERA_NOISE_SD))
PARAMETER_NAMES = ("viscosity", "cohesion")


@dataclass(frozen=True)
class ByStirring:
    """Stir it once, add camera noise, and calibrate with each budget.

    Attributes:
        stirring: The simulator.
        prior: Of the parameters.
        surrogate: "signal", or "discrepancy": the paper's.
        budgets: Ascending; a larger one goes on from a smaller one's simulations.
        bank: Where finished simulations are kept.
    """

    stirring: StirSimulator
    prior: Prior
    surrogate: str
    budgets: tuple[int, ...]
    bank: str | Path

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """theta*, then draws, of viscosity and cohesion: (B, budgets, 1 + DRAWS_EACH, 2)."""
        return np.stack([self._one(truth, int(seed)) for truth, seed in _each(theta, seeds)])

    def _one(self, truth: dict[str, NDArray], seed: int) -> NDArray[np.float64]:
        stirring = self.stirring
        with SimulationBank(self.bank) as bank:
            compute, shape = Compute(bank=bank, batch=BATCH), stirring.observed.shape
            simulate = keeping(stirring.simulate, shape, compute, stirring.identity)
            clean = simulate(truth, np.array([seed]))[0]
            engine = Bolfi(
                self.prior,
                CAMERA_NOISE(clean, generator(seed, Phase.CAMERA_NOISE)),
                seed=seed,
                **engine_options(stirring, self.surrogate),
            )
            fits = after_each(engine, simulate, self.budgets)
            return np.stack([concluded(fit, seed) for fit in fits])

    @property
    def identity(self) -> str:
        """A text that two equal experiments share."""
        made_by = [*_made_by(self.prior), "stir", self.surrogate, self.budgets]
        return json.dumps([*made_by, self.stirring.identity])


@dataclass(frozen=True)
class ByPouring(FluidSimulator):
    """The paper's reference (Lopez-Guevara et al. 2017): a training pour is observed once, and
    Bayesian optimisation seeks the liquid that spills as much.

    Attributes:
        cups: Of training pour and task alike.
        prior: Of the parameters.
        angular_velocity, distance: The training pour [rad/s], [m].
        budgets, bank: See `ByStirring`.
    """

    cups: Cups
    prior: Prior
    angular_velocity: float
    distance: float
    budgets: tuple[int, ...]
    bank: str | Path

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """As `ByStirring.simulate`."""
        return np.stack([self._one(truth, int(seed)) for truth, seed in _each(theta, seeds)])

    def _one(self, truth: dict[str, NDArray], seed: int) -> NDArray[np.float64]:
        rules: dict[str, Any] = {**PAPER_RULES}
        with SimulationBank(self.bank) as bank:
            identity = json.dumps(["training pour", *self._pour], sort_keys=True)
            compute = Compute(bank=bank, batch=BATCH)
            simulate = keeping(self._spilled, (1,), compute, identity)
            engine = Bolfi(
                self.prior,
                simulate(truth, np.array([seed]))[0],
                seed=seed,
                initial=MIN_SIMULATIONS,
                discrepancy=_squared,
                **rules,
            )
            fits = after_each(engine, simulate, self.budgets)
            return np.stack([concluded(fit, seed) for fit in fits])

    def _spilled(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Fraction that the training pour spills, shape (B, 1)."""
        action = models.PourAction(self.angular_velocity, self.distance)
        made = models.pour(models.Liquid(**theta, density=DENSITY), action, self.cups, seeds)
        return np.asarray(made.spilled, np.float64)[:, None]

    @property
    def _pour(self) -> list[Any]:
        return [[self.angular_velocity, self.distance], DENSITY, self.cups.settings()]

    @property
    def identity(self) -> str:
        """A text that two equal experiments share."""
        action = [self.angular_velocity, self.distance]
        made_by = [*_made_by(self.prior), "pour", action, self.budgets]
        return json.dumps([*made_by, self.cups.settings()], sort_keys=True)


Learner = ByStirring | ByPouring


def _made_by(prior: Prior) -> list[Any]:
    """What the conclusions of all learners depend on."""
    learned_by = [engine_version.ENGINE_VERSION, describe_prior(prior), BATCH]
    learned_by += [PAPER_RULES, MIN_SIMULATIONS]
    return [*learned_by, SAMPLING, DRAWS_EACH, CAMERA_NOISE_SD, DENSITY]


def after_each(engine: Bolfi, simulate: Simulator, budgets: Sequence[int]) -> Iterator[Fit]:
    """The fits of one search after each number of simulations, ascending.

    Points are asked in batches that end at each budget, so the budgets affect the points slightly.

    Args:
        engine: Told of nothing yet.
        simulate: Theta and seeds -> signals.
        budgets: Simulations in all.
    """

    rng = generator(engine.seed, Phase.TRUTH_STIRS)
    for budget in budgets:
        while (left := budget - engine.told) > 0:
            theta = engine.ask(min(BATCH, left))
            seeds = rng.integers(2**31, size=min(BATCH, left))
            engine.tell(theta, simulate(theta, seeds), seeds)
        yield engine.fit(warn=False)


def concluded(fit: Fit, seed: int) -> NDArray[np.float64]:
    """theta* and draws, shape (1 + DRAWS_EACH, 2)."""
    sampled = fit.sample(seed=seed, warn=False, **SAMPLING)
    drawn = pick_draws(sampled["posterior"].to_dataset(), DRAWS_EACH, seed)
    return np.column_stack([np.append(fit.best[name], drawn[name]) for name in PARAMETER_NAMES])


def _each(theta: Mapping[str, NDArray], seeds: NDArray) -> Any:
    for at, seed in enumerate(seeds):
        yield {name: np.asarray(values)[at : at + 1] for name, values in theta.items()}, seed


def _squared(observed: NDArray, simulated: NDArray) -> float:
    return float((observed[0] - simulated[0]) ** 2)
