"""A driven oscillator, and effects that it may lack.

Deterministic, with a sensor's correlated noise that is learned from rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.inference import criticism
from subject import Columns, Subject, alone, in_lanes

from bolfi_liquids import inference

RATE, SUBSTEPS = 20, 20  # samples a second, steps a sample
REST, DURATION = 3.0, 14.0  # s, rest included
RUB = 0.02  # m/s below which dry friction is viscous
ABSORBER = (2.0 * np.pi * 0.9) ** 2  # stiffness over mass [1/s2]
NOISE, CORRELATION = 0.02, 0.5  # m, of the sensor and of neighbouring samples

PRIOR = inference.Prior(
    {"stiffness": dist.LogUniform(15.0, 60.0), "damping": dist.LogUniform(0.4, 4.0)},
    {"stiffness": "1/s2", "damping": "1/s"},
)

EXTENSIONS = {
    "cubic": criticism.Extension(dist.Normal(0.0, 0.3)),
    "asymmetry": criticism.Extension(dist.Normal(0.0, 0.3)),
    "friction": criticism.Extension(dist.HalfNormal(0.6), unit="m/s2"),
    "air_drag": criticism.Extension(dist.HalfNormal(1.5), unit="1/m"),
    "delay": criticism.Extension(dist.Normal(0.0, 0.04), unit="s"),
    "gain": criticism.Extension(dist.Normal(0.0, 0.1)),
    "ageing": criticism.Extension(dist.Normal(0.0, 0.2)),
    "drift": criticism.Extension(dist.Normal(0.0, 0.01), unit="m/s"),
}
"""The spring hardens on both sides or on one; dry friction; drag as the square of the speed; the
sensor is late, scales, or drifts; the spring grows stiffer with time."""

OUTSIDE = {
    "backlash": criticism.Extension(dist.HalfNormal(0.06), unit="m"),
    "clipping": criticism.Extension(dist.HalfNormal(1.0), unit="1/m"),
    "hum": criticism.Extension(dist.HalfNormal(0.05), unit="m"),
    "absorber": criticism.Extension(dist.HalfNormal(0.1)),
}
"""The spring does nothing about its middle; the sensor is compressed at its ends; it picks up
another machine; a second mass hangs on the first."""

NAMES = (*PRIOR.names, *EXTENSIONS, *OUTSIDE)


@dataclass(frozen=True)
class Drive:
    """A force of two tones, or of one that rises; `simulate` is what `inference` calls.

    Attributes:
        tones: Frequencies [Hz]: of both tones, or from the first to the last.
        force: Over the mass [m/s2].
        sweeps: Whether one tone rises.
    """

    tones: tuple[float, float]
    force: float
    sweeps: bool

    def simulate(self, theta: Columns, seeds: np.ndarray) -> np.ndarray:
        """Positions [b, 280, 1] in m; seeds change nothing."""
        return self.expected(theta)

    def expected(self, theta: Columns) -> np.ndarray:
        """The same."""
        driven = jnp.asarray(_driven(self.tones, self.force, self.sweeps))
        return in_lanes(partial(_swing, driven), NAMES, theta)[..., None]

    def observe(self, theta: Mapping[str, float], seed: int) -> np.ndarray:
        """What the sensor shows, [280, 1] in m."""
        root = np.linalg.cholesky(self.covariance(theta))
        white = np.random.default_rng([seed, 1]).normal(size=len(root))
        return self.expected(alone(theta))[0] + (root @ white)[:, None]

    def covariance(self, theta: Mapping[str, float]) -> np.ndarray:
        """AR(1), whatever theta [280, 280]."""
        samples = np.arange(int(RATE * DURATION))
        return NOISE**2 * CORRELATION ** np.abs(np.subtract.outer(samples, samples))


@cache
def _driven(tones: tuple[float, float], force: float, sweeps: bool) -> np.ndarray:
    """Force at each step, after the rest [steps]."""
    time = np.arange(0.0, DURATION, 1.0 / (RATE * SUBSTEPS)) - REST
    first, last = (2.0 * np.pi * tone for tone in tones)
    if sweeps:
        wave = np.sin(first * time + 0.5 * (last - first) * time**2 / (DURATION - REST))
    else:
        wave = 0.6 * np.sin(first * time) + 0.6 * np.sin(last * time)
    return (force * wave * np.clip(time / 0.5, 0.0, 1.0)).astype(np.float32)


@jax.jit
def _swing(driven: jax.Array, values: jax.Array) -> jax.Array:
    return jax.vmap(partial(_one, driven))(values)


def _one(driven: jax.Array, values: jax.Array) -> jax.Array:
    """Seen positions [280] of one run."""
    of = dict(zip(NAMES, values, strict=True))
    step = 1.0 / (RATE * SUBSTEPS)

    def advance(now, push):
        place, speed, other, other_speed, time = now
        stretch = place - of["backlash"] * jnp.tanh(place / jnp.maximum(of["backlash"], 1e-6))
        stiff = 1.0 + of["ageing"] * jnp.maximum(time - REST, 0.0) / 10.0
        hard = of["cubic"] * stretch**2 / (0.1 + stretch**2)
        hard = hard + of["asymmetry"] * jnp.tanh(stretch / 0.3)
        spring = of["stiffness"] * stiff * stretch * (1.0 + hard)
        drag = (of["damping"] + of["air_drag"] * jnp.abs(speed)) * speed
        drag = drag + of["friction"] * jnp.tanh(speed / RUB)
        pull = ABSORBER * (place - other) + 0.4 * (speed - other_speed)
        speed = speed + step * (push - spring - drag - of["absorber"] * pull)
        other_speed = other_speed + step * pull
        place, other = place + step * speed, other + step * other_speed
        return (place, speed, other, other_speed, time + step), place

    zero = jnp.zeros((), jnp.float32)
    places = jax.lax.scan(advance, (zero,) * 5, driven)[1]
    fine = jnp.arange(len(places)) * step
    time = fine[::SUBSTEPS]
    seen = (1.0 + of["gain"]) * jnp.interp(time - of["delay"], fine, places)
    squeeze = jnp.maximum(of["clipping"], 1e-4)
    seen = jnp.tanh(squeeze * seen) / squeeze
    moving = jnp.maximum(time - REST, 0.0)
    hum = of["hum"] * jnp.sin(2.0 * jnp.pi * 0.37 * moving) * jnp.minimum(moving, 1.0)
    return seen + of["drift"] * moving + hum


def rest_noise(observed: list[np.ndarray]) -> criticism.Noise:
    """The sensor's noise, from the rests of several data sets."""
    return criticism.rest_noise([one[: int(RATE * REST)] for one in observed])


SUBJECT = Subject(
    name="oscillator",
    prior=PRIOR,
    extensions=EXTENSIONS,
    outside=OUTSIDE,
    fitted=Drive((0.5, 1.15), 6.0, sweeps=False),
    held_out=Drive((0.4, 1.6), 5.0, sweeps=True),
    noise=rest_noise,
    settings="position [m], 20 samples a second, at rest for 3 s and driven for 11 s; fitted: "
    "tones of 0.5 and 1.15 Hz, 3.6 m/s2 each; held out: one tone that rises from 0.4 to 1.6 Hz, "
    "5 m/s2",
)
