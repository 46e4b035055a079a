"""Settings of the commands, declared once: keyword, option with its help, and field of run.toml.

They are checked before anything is simulated.
"""

from collections.abc import Callable, Iterable
from functools import wraps
from operator import index
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, dataclass_transform, get_args

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic.dataclasses import dataclass as validated_dataclass

from ..errors import Argument, InputError

if TYPE_CHECKING:
    from ..inference.criticism import Plan

Surrogate = Literal["signal", "discrepancy"]
"""What is emulated: the inclination itself, or, as in the paper, the discrepancy."""
SURROGATES: tuple[Surrogate, ...] = get_args(Surrogate)
Sampler = Literal["nuts", "emcee"]
"""Of the posterior."""
Risk = Literal["mean", "cvar"]
"""Spillage to keep low: the mean, or that of the worst tenth of the draws."""

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


def _as_names(value: Any) -> Any:
    """One name or several, each once; None for none."""
    several = value if isinstance(value, Iterable) and not isinstance(value, str) else [value]
    names = [one for one in several if one is not None]
    if not all(isinstance(one, str) for one in names):
        raise ValueError("Input should be names, or none")
    return tuple(dict.fromkeys(names)) or None


Integer = Annotated[int, BeforeValidator(_plain_integer)]
Seed = Annotated[Integer, Field(ge=0, le=LARGEST_SEED, description="Seed of all random numbers.")]
Count = Annotated[Integer, Field(ge=1, le=MAX_COUNT)]
Simulations = Annotated[Integer, Field(ge=MIN_SIMULATIONS, le=MAX_SIMULATIONS)]
Particles = Annotated[
    Integer,
    Field(
        ge=0,
        le=MAX_PARTICLES,
        description="Number of particles; 0: cells follow the stick, or the cup that pours.",
    ),
    AfterValidator(_as_many),
]
Pours = Annotated[Integer, Field(ge=MIN_POURS, le=MAX_POURS)]
Names = Annotated[tuple[str, ...] | None, BeforeValidator(_as_names)]

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
            if len(values) > len(names):
                raise TypeError(f"{cls.__name__} takes {len(names)} values, got {len(values)}")
            try:
                validate(self, **dict(zip(names, values, strict=False)), **named)
            except ValidationError as err:
                raise InputError.from_validation(err, where=place) from None

        def place(name: str) -> str:
            return where.format(name) if where else Argument(name)

        made.__init__ = init
        return made

    return decorate


def helped(text: str, *, metavar: str = "", **limits: Any) -> Any:
    """The help of an option, what stands for its value there, and limits of its values."""
    shown: Any = {"metavar": metavar} if metavar else None
    return Field(description=text, json_schema_extra=shown, **limits)


@checked()
class CalibrationSettings:
    """Settings of a calibration, which is decided by them, its recordings and its prior."""

    budget: Annotated[Simulations, helped("Simulations of the search; 60 with --until.")] = 20
    until: Annotated[
        str | None,
        helped(
            "End earlier, once the pour (spillage=SHARE) or intervals (intervals=SDS) are known.",
            metavar="QUANTITY=TOLERANCE",
        ),
    ] = None
    batch: Annotated[Count, helped("Simulations run at the same time.")] = 4
    seed: Seed = 0
    surrogate: Annotated[Surrogate, helped("What is emulated, see guide priors.")] = "signal"
    particles: Particles = 0
    sampler: Annotated[Sampler, helped("Sampler of the posterior.")] = "nuts"
    chains: Annotated[Integer, helped("Chains of the sampler; R-hat needs two.", ge=2, le=1000)] = 4
    draws: Annotated[Integer, helped("Draws kept of each chain.", ge=4, le=MAX_COUNT)] = 1000


@checked()
class BaselineSettings:
    """Settings of a baseline, beside its recordings and prior."""

    particles: Particles = 0


@checked()
class SbcSettings:
    """Settings of a check of calibrations; a recording gives path and rig."""

    runs: Annotated[
        Integer, helped("Replicates of the emulator of the inclination.", ge=0, le=MAX_COUNT)
    ] = 200
    sequential: Annotated[
        Integer, helped("Replicates of the paper's surrogate.", ge=0, le=MAX_COUNT)
    ] = 40
    design: Annotated[
        Simulations, helped("Points that the emulator's replicates share, each stirred twice.")
    ] = 512
    budget: Annotated[Simulations, helped("Simulations of each replicate's search.")] = 20
    noise_deg: Annotated[float, helped("Of the cameras [deg].", gt=0.0, lt=90.0)] = 0.1
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

    def calibration(self, surrogate: Surrogate) -> CalibrationSettings:
        """Settings of one replicate: those of `calibrate`."""
        return CalibrationSettings(
            budget=self.budget, surrogate=surrogate, particles=self.particles
        )


@checked()
class PourSettings:
    """Settings of the choice of a pour, beside posterior and cups."""

    budget: Annotated[Pours, helped("Pours simulated at most.")] = 64
    iterations: Annotated[Simulations, helped("Angular velocities tried.")] = 31
    draws: Annotated[Count, helped("Posterior draws that each action is tried on.")] = 128
    risk: Annotated[Risk, helped("Spillage to keep low: the mean, or the worst tenth's.")] = "mean"
    seed: Seed = 0


@checked()
class CriticismSettings:
    """Settings of a criticism, beside its data."""

    effects: Annotated[
        Names, helped("Effect to consider, else all. Repeatable.", metavar="EFFECT")
    ] = None
    accept: Annotated[
        Names, helped("Effect to add whatever the verdict. Repeatable.", metavar="EFFECT")
    ] = None
    seed: Seed = 0
    batch: Annotated[Count, helped("Simulations in one call, where there is no executor.")] = 32

    @property
    def stir_plan(self) -> "Plan":
        """Runs of each step for stirs: usually 70 to 100 in all, three baselines included."""
        from ..inference.criticism import Plan

        return Plan(base=4, look=2, refit=4, refits=3, held_out=3, most=32)

    @property
    def pour_plan(self) -> "Plan":
        """Runs of each step for pours, of which each makes the whole table."""
        from ..inference.criticism import Plan

        return Plan(start=12, extension=4, look=2, refit=4, refits=3)
