"""An effect: one coefficient whose neutral value leaves the base model as it was."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .liquid import FIELDS
from .rig import Rig

if TYPE_CHECKING:
    from numpyro.distributions import Distribution

RigHook = Callable[[Rig, np.ndarray], Rig]
KernelHook = Callable[[], Callable[..., Any]]
WettingHook = Callable[[np.ndarray, np.ndarray], np.ndarray]
SignalHook = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]

SCENES = {"liquid": ("stir", "pour"), "rig": ("stir",), "sensor": ("stir",)}
# acts_in -> hooks of which such an effect needs at least one
HOOKS = {"rig": ("rig",), "sensor": ("signal",), "liquid": ("make_rheology", "wetting")}


@dataclass(frozen=True)
class Effect:
    """A physical effect that the base model leaves out.

    The hooks `rig`, `wetting` and `signal` are pure functions of NumPy arrays. They are given only
    the B simulations whose coefficient is not neutral, so the others keep their bits whatever a
    hook computes. A rheology is compiled into the simulation, which is why an effect has a function
    that makes it: it imports taichi, as this package does when it first simulates. It is called
    once a scene, and a scene runs only simulations in which all its effects act.

    Attributes:
        name: Name of the effect and of its coefficient, a Python identifier.
        unit: Unit of the coefficient, "1" if it has none.
        neutral: Coefficient at which there is no effect.
        acts_in: Where it acts; this also decides in which scenes.
        text: One sentence for a person.
        source: Citation or derivation.
        make_prior: Builds the coefficient's prior, a numpyro distribution; called once, when
            `prior` is first read, so that simulating needs no numpyro.
        rig: (rig, coefficient [B]) -> rig, of the same shapes.
        signal: (time [T] in s, angles [B, T, 2] in rad, coefficient [B]) -> angles. The angles
            are finite: a stir that diverged is passed by.
        make_rheology: Returns a `ti.func` (viscosity, shear_rate, time, coefficient) ->
            viscosity: of a particle and dynamic [Pa s], root of 2 D:D [1/s], since the
            recording or the pour began [s].
        wetting: (cosine [B], coefficient [B]) -> cosine [B], of the contact angle of the liquid
            with the cup that pours. Of an effect with both hooks, stirs keep the rheology alone.
        lowest, highest: Coefficients outside are refused.

    Raises:
        ValueError: a field makes no sense, or the hook that `acts_in` needs is missing.
    """

    name: str
    unit: str
    neutral: float
    acts_in: Literal["liquid", "rig", "sensor"]
    text: str
    source: str
    make_prior: Callable[[], "Distribution"]
    rig: RigHook | None = None
    signal: SignalHook | None = None
    make_rheology: KernelHook | None = None
    wetting: WettingHook | None = None
    lowest: float = -math.inf
    highest: float = math.inf

    def __post_init__(self) -> None:
        for fault in self._faults():
            raise ValueError(f"effect {self.name!r}: {fault}")

    def _faults(self) -> Iterator[str]:
        if not (isinstance(self.name, str) and self.name.isidentifier()):
            yield "name must be an identifier"
        if self.name in FIELDS:
            yield f"name is taken by a liquid's {self.name}; choose another"
        for field in ("unit", "text", "source"):
            value = getattr(self, field)
            if not (isinstance(value, str) and value.strip()):
                yield f"{field} must say something, got {value!r}"
        if isinstance(self.neutral, bool) or not isinstance(self.neutral, (int, float)):
            yield f"neutral must be a number, got {self.neutral!r}"
        if not self.lowest <= self.neutral <= self.highest or not math.isfinite(self.neutral):
            limits = f"between {self.lowest} and {self.highest}"
            yield f"neutral must be finite and lie {limits}, got {self.neutral}"
        if self.acts_in not in SCENES:
            yield f"acts_in must be one of {', '.join(SCENES)}, got {self.acts_in!r}"
        if not callable(self.make_prior):
            yield f"make_prior must return a numpyro distribution, got {self.make_prior!r}"
        needed = HOOKS[self.acts_in]
        if all(getattr(self, hook) is None for hook in needed):
            yield f"acts_in={self.acts_in!r} needs the hook {' or '.join(needed)}"
        for hook in (hook for hooks in HOOKS.values() for hook in hooks):
            value = getattr(self, hook)
            if value is not None and not callable(value):
                yield f"the hook {hook} must be a function, got {value!r}"

    @property
    def parameter(self) -> str:
        """Name of the coefficient among the parameters of a fit: the effect's own."""
        return self.name

    @property
    def scenes(self) -> tuple[str, ...]:
        """Scenes in which it acts: "stir", "pour"; elsewhere its coefficient changes nothing.

        Stirs know no surface tension, so how a liquid wets walls is nothing to them.
        """
        if self.acts_in == "liquid" and self.make_rheology is None:
            return ("pour",)
        return SCENES[self.acts_in]

    @cached_property
    def prior(self) -> "Distribution":
        """Prior of the coefficient; numpyro loads with the first one read."""
        return self.make_prior()


def prior_of(family: str, *numbers: float) -> Callable[[], "Distribution"]:
    """A `make_prior` for the distribution of numpyro of that name and these arguments."""
    return partial(_distribution, family, numbers)


def _distribution(family: str, numbers: tuple[float, ...]) -> "Distribution":
    import numpyro.distributions as dist

    return getattr(dist, family)(*numbers)
