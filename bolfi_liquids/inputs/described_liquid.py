"""A liquid that a person describes by numbers, rather than by a recording."""

import json
import math
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ..errors import Argument, InputError
from .limits import as_number
from .settings import Particles, Seed, checked
from .table import parse_number

if TYPE_CHECKING:
    from ..models import Liquid


VISCOSITY, COHESION, DENSITY = 1.0, 0.2, 1260.0  # Pa s, 1, kg/m3: the bundled glycerin
MAX_VISCOSITY, MAX_DENSITY = 1e6, 20_000.0  # Pa s, kg/m3: pitch by far, and mercury


@checked()
class Described:
    """A liquid and how it is simulated.

    Attributes:
        viscosity: [Pa s].
        cohesion: 0 to 1, the simulator's useful range.
        density: [kg/m³].
        effects: Coefficients of `models.EFFECTS` by name.
        particles: Number of particles of the simulated liquid; 0: as its cells make that.
        seed: Seed of the packing.

    Raises:
        InputError: A value cannot be used.
    """

    viscosity: Annotated[float, Field(ge=0.0, le=MAX_VISCOSITY)]
    cohesion: Annotated[float, Field(ge=0.0, le=1.0)]
    density: Annotated[float, Field(gt=0.0, le=MAX_DENSITY)]
    effects: Mapping[str, float] = Field(default_factory=dict)
    particles: Particles = 0
    seed: Seed = 0

    def liquid(self) -> "Liquid":
        """The liquid, as the simulator takes it."""
        from ..models import Liquid

        return Liquid(self.viscosity, self.cohesion, self.density)

    def lines(self) -> list[str]:
        """A description in three lines."""
        effects = [f"{name} {value:g}" for name, value in self.effects.items()]
        many = f"{self.particles} particles, " if self.particles else ""
        return [
            f"viscosity {self.viscosity:g} Pa s, cohesion {self.cohesion:g}",
            ", ".join([f"{self.density:g} kg/m³", *effects]),
            f"{many}seed {self.seed}",
        ]

    def attributes(self) -> dict[str, float | int | str]:
        """Attributes of a file that holds what the liquid did."""
        from ..models import MODEL_VERSION

        release = version("bolfi-liquids")
        return {
            "source": f"simulated by bolfi-liquids {release}, model {MODEL_VERSION}",
            "viscosity": self.viscosity,
            "cohesion": self.cohesion,
            "liquid_density": self.density,
            "effects": json.dumps(dict(self.effects)),
            "particles": self.particles,
            "seed": self.seed,
        }


def read_effects(given: Iterable[str], scene: str) -> dict[str, float]:
    """Coefficients by name, from texts NAME=VALUE.

    Args:
        given: The texts.
        scene: "stir" or "pour".

    Raises:
        InputError: One is given twice, or see `check_effects`.
    """
    read: dict[str, float | str] = {}
    for text in given:
        name, _, value = (part.strip() for part in text.partition("="))
        if name in read:
            raise InputError("given twice", where=f"--effect {text}", fix="give it once")
        try:
            read[name] = parse_number(value)
        except ValueError:
            read[name] = value  # refused as a coefficient
    return check_effects(read, scene)


def check_effects(effects: Mapping[str, Any] | None, scene: str) -> dict[str, float]:
    """Coefficients that can act in a scene, "stir" or "pour".

    Raises:
        InputError: They are no numbers by name, or one is unknown, out of its range, or acts in
            the other scene only.
    """
    from ..models import EFFECTS

    effects = {} if effects is None else effects
    if not isinstance(effects, Mapping):
        raise InputError(
            f"{effects!r:.80}", where=Argument("effects"), fix="give coefficients by name"
        )
    acting = sorted(name for name, effect in EFFECTS.items() if scene in effect.scenes)
    for name, value in effects.items():
        number = as_number(value)
        where = f"--effect {name}={value if math.isnan(number) else f'{number:g}'}"
        if name not in acting:
            what = f"does not act in a {scene}" if name in EFFECTS else "unknown"
            raise InputError(what, where=where, fix=f"there are {', '.join(acting)}")
        effect = EFFECTS[name]
        if not effect.lowest <= number <= effect.highest:
            ends = f"from {effect.lowest:g} to {effect.highest:g} in the unit {effect.unit}"
            what = f"{value!r:.80} is no coefficient of it"
            raise InputError(what, where=where, fix=f"give {name}=NUMBER, {ends}")
    return {name: as_number(value) for name, value in effects.items()}
