"""Settings of a calibration and of a pour, checked before anything is simulated."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from ..inference import Plan

SURROGATES = ("signal", "discrepancy")
SAMPLERS = ("nuts", "emcee")
RISKS = ("mean", "cvar")

PAPER_RULES = {"acquisition": "lcb", "threshold": "min_mean"}
"""What goes with the paper's surrogate, and what results were measured on."""

RUNS = 2  # of each point of a set of stirs that calibrations share: the engine asks for replicates
ALARM = 0.05  # share of false alarms when simulation and data are compared
MIN_SIMULATIONS = 7  # fewer say next to nothing of two parameters
MIN_PARTICLES = 100  # with fewer, the stick is thinner than the gaps between them
_LEAST = {
    "budget": MIN_SIMULATIONS,
    "batch": 1,
    "seed": 0,
    "particles": MIN_PARTICLES,
    "chains": 2,
    "draws": 4,
}


@dataclass(frozen=True)
class CalibrationSettings:
    """What decides a calibration besides its recordings and prior.

    Attributes:
        budget: Simulations that the engine may learn from.
        batch: Simulations run at the same time.
        seed: Of everything random.
        surrogate: "discrepancy", the paper's, or "signal", which emulates the inclination itself.
        particles: Of the simulated liquid.
        sampler: "nuts" or "emcee".
        chains: Of the sampler; two at least, for R-hat needs them.
        draws: Kept, for each chain.
    """

    budget: int = 20
    batch: int = 4
    seed: int = 0
    surrogate: str = "discrepancy"
    particles: int = 1000
    sampler: str = "nuts"
    chains: int = 4
    draws: int = 1000

    def __post_init__(self):
        for name, least in _LEAST.items():
            at_least(least, f"--{name}", getattr(self, name))
        one_of(SURROGATES, "--surrogate", self.surrogate)
        one_of(SAMPLERS, "--sampler", self.sampler)


@dataclass(frozen=True)
class SbcSettings:
    """What decides a check of calibrations besides the recording that gives path and rig.

    Attributes:
        runs: Replicates of the emulator of the inclination, which share their simulations.
        sequential: Replicates of the paper's surrogate, each with simulations of its own.
        design: Points that the former share, each stirred twice.
        budget: Simulations that each learns from.
        noise_deg: Of the cameras, added to each simulated sample [deg].
        particles: Of the simulated liquid.
        seed: Of everything random.
    """

    runs: int = 200
    sequential: int = 40
    design: int = 512
    budget: int = 20
    noise_deg: float = 0.1
    particles: int = 1000
    seed: int = 0

    def __post_init__(self):
        least = {"runs": 0, "sequential": 0, "design": MIN_SIMULATIONS, "seed": 0}
        for name, lowest in least.items():
            at_least(lowest, f"--{name}", getattr(self, name))
        if not 0.0 < self.noise_deg < 90.0:
            raise InputError(
                f"{self.noise_deg!r}", where="--noise", fix="give degrees above 0, such as 0.1"
            )
        self.calibration("discrepancy")
        if self.runs and self.budget > RUNS * self.design:
            raise InputError(
                f"{self.budget} simulations each, but {RUNS} of {self.design} points are shared",
                where="--design",
                fix=f"give {-(-self.budget // RUNS)} at least, or a smaller --budget",
            )

    @property
    def replicates(self) -> dict[str, int]:
        """How many, by surrogate."""
        return {"signal": self.runs, "discrepancy": self.sequential}

    def calibration(self, surrogate: str) -> CalibrationSettings:
        """Of one replicate: as `calibrate` has it."""
        return CalibrationSettings(
            budget=self.budget, surrogate=surrogate, particles=self.particles
        )


@dataclass(frozen=True)
class PourSettings:
    """What decides the choice of a pour besides the posterior and the cups.

    Attributes:
        iterations: Angular velocities that are tried, each with every distance.
        draws: Posterior draws over which spillage is averaged, and again among the best actions.
        risk: "mean", or "cvar": the mean over the worst tenth of the draws.
        seed: Of everything random.
    """

    iterations: int = 15
    draws: int = 16
    risk: str = "mean"
    seed: int = 0

    def __post_init__(self):
        for name, least in {"iterations": MIN_SIMULATIONS, "draws": 1, "seed": 0}.items():
            at_least(least, f"--{name}", getattr(self, name))
        one_of(RISKS, "--risk", self.risk)


@dataclass(frozen=True)
class CriticismSettings:
    """What decides a criticism besides its data.

    Attributes:
        effects: Names of those that are considered; None is all.
        accept: Names of those that join the model whatever the verdict.
        seed: Of everything random.
        batch: Simulations run at the same time.
    """

    effects: tuple[str, ...] | None = None
    accept: tuple[str, ...] | None = None
    seed: int = 0
    batch: int = 4

    def __post_init__(self):
        at_least(0, "--seed", self.seed)

    @property
    def stir_plan(self) -> "Plan":
        """Runs of each step for stirs.

        With held-out runs of four models, proposals and six baselines, at most 350 in all.
        """
        from ..inference import Plan

        return Plan(base=24, extension=8, refit=12, held_out=6, most=168)

    @property
    def pour_plan(self) -> "Plan":
        """The same for pours, of which each run makes the whole table."""
        from ..inference import Plan

        return Plan(start=12, base=12, extension=8, refit=10)

    @property
    def clean_plan(self) -> "Plan":
        """The same for each clean recording."""
        from ..inference import Plan

        return Plan(start=8, base=8)


def at_least(lowest: int, where: str, value: object) -> None:
    """Raise `InputError` unless `value` is a whole number of at least `lowest`."""
    if not isinstance(value, int) or isinstance(value, bool) or value < lowest:
        raise InputError(
            f"{value!r}",
            where=where,
            fix=f"give a whole number of at least {lowest}",
        )


def one_of(choices: tuple[str, ...], where: str, value: object) -> None:
    """Raise `InputError` unless `value` is one of the choices."""
    if value not in choices:
        raise InputError(f"{value!r}", where=where, fix=f"choose {' or '.join(choices)}")
