"""Settings of the commands, checked before anything is simulated."""

from collections.abc import Callable
from functools import wraps
from operator import index
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, dataclass_transform

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic.dataclasses import dataclass as validated_dataclass

from ..errors import Argument, InputError

if TYPE_CHECKING:
    from ..inference.criticism import Plan

SURROGATES = ("signal", "discrepancy")
SAMPLERS = ("nuts", "emcee")
RISKS = ("mean", "cvar")

PAPER_RULES = {"acquisition": "lcb", "threshold": "min_mean"}
"""Engine options that go with the paper's surrogate, on which the results were measured."""
RUNS_PER_POINT = 2
"""Of the stirs that calibrations share: the engine asks for replicates."""
FALSE_ALARM_RATE = 0.05
"""Of the comparison between simulation and data."""
MIN_SIMULATIONS = 7
"""With fewer, the posterior over two parameters says next to nothing."""
MAX_SIMULATIONS = 8192
"""That a posterior is learned from; the engine's own limit."""
MAX_PARTICLES = 1_000_000
"""More fit into no memory."""
MAX_COUNT = 1_000_000
"""Of draws, simulations at a time and the like: more is a slip of the pen."""
LARGEST_SEED = 2**31 - 1
"""That every random number generator takes."""
MIN_POURS, MAX_POURS = 24, 100
"""Of one decision: with fewer its map is coarse, and with more it is hardly finer."""
MIN_MAP_POURS = 16
"""From fewer, a map of three inputs learns next to nothing."""
PRIOR_POURS = 192
"""For a map of all liquids, which then misses pours left out by .02."""
MIN_PARTICLES = 100
"""With fewer, the stick is thinner than the gaps between them."""


def one_of(choices: tuple[str, ...]) -> AfterValidator:
    """A rule for texts."""

    def check(value: str) -> str:
        if value not in choices:
            raise ValueError(f"Input should be {' or '.join(map(repr, choices))}")
        return value

    return AfterValidator(check)


def _as_many(value: int) -> int:
    if 0 < value < MIN_PARTICLES:
        raise ValueError(f"Input should be 0 or at least {MIN_PARTICLES}")
    return value


def _plain_integer(value: Any) -> Any:
    """Integers of other libraries as Python's own; anything else as it is."""
    try:
        return value if isinstance(value, bool) else index(value)
    except TypeError:
        return value


def _each_once(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


Integer = Annotated[int, BeforeValidator(_plain_integer)]
Seed = Annotated[Integer, Field(ge=0, le=LARGEST_SEED)]
Count = Annotated[Integer, Field(ge=1, le=MAX_COUNT)]
Simulations = Annotated[Integer, Field(ge=MIN_SIMULATIONS, le=MAX_SIMULATIONS)]
Particles = Annotated[Integer, Field(ge=0, le=MAX_PARTICLES), AfterValidator(_as_many)]
"""0: cells follow the stick, or the cup that pours."""
Pours = Annotated[Integer, Field(ge=MIN_POURS, le=MAX_POURS)]
Surrogate = Annotated[str, one_of(SURROGATES)]
Names = Annotated[tuple[str, ...], AfterValidator(_each_once)]

T = TypeVar("T")


@dataclass_transform(frozen_default=True, field_specifiers=(Field,))
def checked(where: str = "") -> Callable[[type[T]], type[T]]:
    """Make a frozen dataclass whose values are checked by their annotations.

    Args:
        where: How a refusal names a field; the braces stand for its name. Nothing stands for
            fields that are arguments of a function.

    Returns:
        A class decorator. The class raises `InputError` at the first value that breaks a rule.
    """

    def decorate(cls: type[T]) -> type[T]:
        rules = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
        made: Any = validated_dataclass(frozen=True, config=rules)(cls)
        validate, names = made.__init__, tuple(made.__dataclass_fields__)

        @wraps(validate)
        def init(self: T, *values: Any, **named: Any) -> None:
            try:
                validate(self, **dict(zip(names, values, strict=False)), **named)
            except ValidationError as err:
                raise InputError.from_validation(err, where=place) from None

        def place(name: str) -> str:
            return where.format(name) if where else Argument(name)

        made.__init__ = init
        return made

    return decorate


@checked()
class CalibrationSettings:
    """What decides a calibration besides its recordings and prior.

    Attributes:
        budget: Simulations of the search.
        batch: Simulations run at the same time.
        seed: Seed of all random draws.
        surrogate: "signal", which emulates the inclination itself, or "discrepancy", the paper's.
        particles: Number of particles of the simulated liquid; 0: cells follow the stick.
        sampler: "nuts" or "emcee".
        chains: Number of chains; R-hat needs at least two.
        draws: Draws kept of each chain.
    """

    budget: Simulations = 20
    batch: Count = 4
    seed: Seed = 0
    surrogate: Surrogate = "signal"
    particles: Particles = 0
    sampler: Annotated[str, one_of(SAMPLERS)] = "nuts"
    chains: Annotated[Integer, Field(ge=2, le=1000)] = 4
    draws: Annotated[Integer, Field(ge=4, le=MAX_COUNT)] = 1000


@checked()
class SbcSettings:
    """What decides a check of calibrations besides the recording that gives path and rig.

    Attributes:
        runs: Replicates of the emulator of the inclination, which share their simulations.
        sequential: Replicates of the paper's surrogate, each with simulations of its own.
        design: Points that the former share, each stirred twice.
        budget: Simulations of each one's search.
        noise_deg: Standard deviation of the cameras' noise, added to each simulated sample [deg].
        particles: Number of particles of the simulated liquid; 0: cells follow the stick.
        seed: Seed of all random draws.
    """

    runs: Annotated[Integer, Field(ge=0, le=MAX_COUNT)] = 200
    sequential: Annotated[Integer, Field(ge=0, le=MAX_COUNT)] = 40
    design: Simulations = 512
    budget: Simulations = 20
    noise_deg: Annotated[float, Field(gt=0.0, lt=90.0)] = 0.1
    particles: Particles = 0
    seed: Seed = 0

    def __post_init__(self):
        if self.runs and self.budget > RUNS_PER_POINT * self.design:
            raise InputError(
                f"{self.budget} simulations each, but {RUNS_PER_POINT} of {self.design} points "
                "are shared",
                where=Argument("design"),
                fix=f"give {-(-self.budget // RUNS_PER_POINT)} at least, or a smaller `budget`",
            )

    @property
    def replicates(self) -> dict[str, int]:
        """Their number, by surrogate."""
        return {"signal": self.runs, "discrepancy": self.sequential}

    def calibration(self, surrogate: str) -> CalibrationSettings:
        """Settings of one replicate: those of `calibrate`."""
        return CalibrationSettings(
            budget=self.budget, surrogate=surrogate, particles=self.particles
        )


@checked()
class PourSettings:
    """What decides the choice of a pour besides the posterior and the cups.

    Attributes:
        budget: Pours that are simulated at most; a map of landings is learned from them.
        iterations: Angular velocities that are tried on the map, each with every distance.
        draws: Posterior draws over which spillage is averaged.
        risk: "mean", or "cvar": the mean over the worst tenth of the draws.
        seed: Seed of all random draws.
    """

    budget: Pours = 64
    iterations: Simulations = 31
    draws: Count = 128
    risk: Annotated[str, one_of(RISKS)] = "mean"
    seed: Seed = 0


@checked()
class CriticismSettings:
    """What decides a criticism besides its data.

    Attributes:
        effects: Names of those that are considered; None is all.
        accept: Names of those that join the model whatever the verdict.
        seed: Seed of all random draws.
        batch: Simulations in one call where there is no executor; a thread takes four.
    """

    effects: Names | None = None
    accept: Names | None = None
    seed: Seed = 0
    batch: Count = 32

    @property
    def stir_plan(self) -> "Plan":
        """Runs of each step for stirs: usually 70 to 100 in all, three baselines included."""
        from ..inference.criticism import Plan

        return Plan(base=4, look=2, refit=4, refits=3, held_out=3, most=32)

    @property
    def pour_plan(self) -> "Plan":
        """Runs of each step for pours, of which each makes the whole table."""
        from ..inference.criticism import Plan

        return Plan(start=12, look=2, refit=4, refits=3)
