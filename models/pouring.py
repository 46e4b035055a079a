"""Pouring: an action in, the fractions spilled, received and retained out."""

import os
import tomllib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, PositiveFloat, ValidationError, model_validator

from . import runtime
from .liquid import Liquid
from .numerics import MODEL_VERSION, Numerics
from .packing import pack_cylinder

PARTICLES = 664  # 5 mm apart in the bundled cups
SETTLING = 0.6  # s
DRIP = 1.2  # s beyond the cups' hold; viscous liquids need it, and others end earlier
CHUNK = 240  # substeps a kernel call


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Source(_Section):
    """The cup that turns [m]; `fill` is the liquid's depth before the pour."""

    radius: PositiveFloat
    height: PositiveFloat
    fill: PositiveFloat

    @model_validator(mode="after")
    def _holds_its_fill(self) -> "Source":
        if self.fill > self.height:
            raise ValueError(f"fill {self.fill} m is more than the height {self.height} m")
        return self


class Receiver(_Section):
    """The cup below [m]."""

    radius: PositiveFloat
    height: PositiveFloat


class PourPlan(_Section):
    """How the source turns, and the range of the decision, in the units that people type."""

    lip_height: PositiveFloat
    final_angle_deg: PositiveFloat
    hold: PositiveFloat
    angular_velocity_deg_s: tuple[PositiveFloat, PositiveFloat]
    distance: tuple[float, float]

    @property
    def final_angle(self) -> float:
        """Angle at which the source stays [rad]."""
        return float(np.radians(self.final_angle_deg))

    @property
    def angular_velocity_range(self) -> tuple[float, float]:
        """Range of the decision [rad/s]."""
        low, high = np.radians(self.angular_velocity_deg_s)
        return float(low), float(high)

    @property
    def distance_range(self) -> tuple[float, float]:
        """Range of the decision [m]."""
        return self.distance

    @model_validator(mode="after")
    def _ranges_ascend(self) -> "PourPlan":
        for name in ("angular_velocity_deg_s", "distance"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} must ascend, got [{low}, {high}]")
        return self


class Cups(_Section):
    """Geometry of a pour; `models` of a cups.toml file."""

    source: Source
    receiver: Receiver
    pour: PourPlan

    @model_validator(mode="after")
    def _receiver_below_lip(self) -> "Cups":
        if self.pour.lip_height <= self.receiver.height:
            raise ValueError(
                f"the lip ({self.pour.lip_height} m) is not above the receiver's rim "
                f"({self.receiver.height} m)"
            )
        return self

    @classmethod
    def from_toml(cls, path: str | Path) -> "Cups":
        """Read a cups.toml.

        Raises:
            ValueError: naming file, field and value.
            FileNotFoundError: there is no such file.
        """
        try:
            return cls.model_validate(tomllib.loads(Path(path).read_text(encoding="utf-8")))
        except tomllib.TOMLDecodeError as err:
            raise ValueError(f"{path}: not a TOML file: {err}") from err
        except ValidationError as err:
            first = err.errors()[0]
            field = ".".join(str(part) for part in first["loc"]) or "cups"
            raise ValueError(
                f"{path}: {field}: {first['msg']}, got {first.get('input')!r}"
            ) from err

    @property
    def angular_velocity_range(self) -> tuple[float, float]:
        """Range of the decision [rad/s]."""
        return self.pour.angular_velocity_range

    @property
    def distance_range(self) -> tuple[float, float]:
        """Range of the decision [m]."""
        return self.pour.distance_range

    def settings(self, particles: int = PARTICLES) -> dict[str, Any]:
        """Everything that fixes the simulator, as plain numbers, with the model's version."""
        scene = {"model": MODEL_VERSION, "scene": "pour", "particles": particles}
        return {**scene, "numerics": asdict(Numerics()), **self.model_dump()}


@dataclass(frozen=True)
class PourAction:
    """Angular velocity of the source [rad/s] and distance from its lip to the receiver's axis [m].

    Scalars or arrays of shape [B].
    """

    angular_velocity: ArrayLike
    distance: ArrayLike


@dataclass(frozen=True)
class PourResult:
    """Fractions of all particles, shape [B] each; they sum to 1.

    What still flies at the end counts as spilled.
    """

    spilled: np.ndarray
    received: np.ndarray
    retained: np.ndarray


def pour(
    liquid: Liquid,
    action: PourAction,
    cups: Cups,
    seeds: ArrayLike,
    particles: int = PARTICLES,
    progress: Callable[[float], None] | None = None,
) -> PourResult:
    """Where the liquid ends when the source turns about its lip to its final angle and holds.

    Args:
        liquid: B liquids; scalars are shared.
        action: B actions; scalars are shared.
        cups: Geometry.
        seeds: One integer a simulation, shape [B]; it decides the initial packing.
        particles: Number of particles.
        progress: Called with the fraction done.

    Raises:
        ValueError: lengths do not agree, or an action is not finite or does not turn.
        RuntimeError: neighbour lists overflowed.
    """
    seeds = np.atleast_1d(np.asarray(seeds))
    liquid = liquid.batch(len(seeds))
    rate = _batch("angular_velocity", action.angular_velocity, len(seeds))
    distance = _batch("distance", action.distance, len(seeds))
    if (rate <= 0).any():
        raise ValueError(f"angular_velocity must be positive [rad/s], got {rate.min()}")
    scene = _scene(cups, particles)
    counts = []
    for low in range(0, len(seeds), scene.slots):
        part = slice(low, low + scene.slots)
        counts.append(_run(scene, cups, liquid[part], (rate[part], distance[part]), seeds[part]))
        if progress is not None:
            progress(min(low + scene.slots, len(seeds)) / len(seeds))
    spilled, received, retained = np.concatenate(counts, axis=1) / particles
    return PourResult(spilled, received, retained)


def _batch(name: str, value: ArrayLike, size: int) -> np.ndarray:
    array = np.asarray(value, dtype=np.float32)
    if array.ndim > 1 or array.size not in (1, size) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite and of shape () or ({size},), got {value}")
    return np.broadcast_to(array, (size,))


def spacing(cups: Cups, particles: int) -> float:
    """Particle spacing [m], the cube root of the liquid's volume per particle."""
    volume = np.pi * cups.source.radius**2 * cups.source.fill
    return float((volume / particles) ** (1.0 / 3.0))


@cache
def _scene(cups: Cups, particles: int):
    """The compiled scene; its fields live as long as the process."""
    runtime.start()
    from .pouring_kernel import PouringScene

    slots = max(8, os.cpu_count() or 1)
    return PouringScene(slots, particles, spacing(cups, particles), Numerics(), cups)


def _run(scene, cups, liquid, action, seeds) -> np.ndarray:
    """Particles spilled, received and retained, shape [3, B]."""
    size = len(seeds)
    rate, distance = action
    source = cups.source
    shift = np.float32([source.radius, 0.0, source.height])
    scene.place(
        np.stack(
            [
                pack_cylinder(source.radius, scene.spacing, scene.particles, int(s)) - shift
                for s in seeds
            ]
        )
    )
    scene.place_cups(rate, distance)
    scene.relax_packing(size, SETTLING)
    scene.pour_in(liquid)
    hold = cups.pour.hold + DRIP
    steps = int((cups.pour.final_angle / rate.min() + hold) * scene.numerics.rate)
    for start in range(0, steps, CHUNK):
        scene.pour(size, start, min(start + CHUNK, steps), hold)
    scene.count(size)
    scene.check_capacity()
    return np.stack(
        [field.to_numpy()[:size] for field in (scene.spilled, scene.received, scene.retained)]
    )
