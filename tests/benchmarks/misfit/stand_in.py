"""A stir that takes milliseconds, with effects that it may lack: a stand-in for the fluid.

A stick that pivots freely is dragged by a liquid of one drag coefficient, which follows the stick
as an eddy of another. Runs differ by their seed: a smooth error of .15 degrees stands for the
packing of particles, and is in the data as well.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.hardware.motion import star
from bolfi_liquids.inference import criticism
from scipy.ndimage import gaussian_filter1d
from subject import Columns, Subject, alone, in_lanes

from bolfi_liquids import inference

GRAVITY, LENGTH, WET = 9.81, 0.22, 0.9  # m/s2, m, where the liquid's force acts over LENGTH
BUOYANCY = 0.12  # share of the weight's moment
SUBSTEPS = 8  # for each of 30 samples a second
REST, DURATION = 2.0, 8.0  # s
EDDY = 0.4  # s, in which the liquid follows
RUB = 0.05  # rad/s below which dry friction is viscous
SLOSH = 2.0 * np.pi * 2.4  # rad/s

JITTER, JITTER_TIME = np.deg2rad(0.15), 0.1  # of a run: size, and correlation time [s]
NOISE, CORRELATION = np.deg2rad(0.2), 0.6  # of the cameras, of neighbouring samples

PRIOR = inference.Prior({"drag": dist.LogUniform(0.3, 10.0), "eddy": dist.Uniform(0.0, 0.6)})

EXTENSIONS = {
    "friction": criticism.Extension(dist.HalfNormal(0.6)),
    "thinning": criticism.Extension(dist.HalfNormal(0.6)),
    "wall": criticism.Extension(dist.HalfNormal(2.0)),
    "fill": criticism.Extension(dist.Normal(0.0, 0.2)),
    "tilt": criticism.Extension(dist.Normal(0.0, 0.05)),
    "delay": criticism.Extension(dist.Normal(0.0, 0.05)),
    "drift": criticism.Extension(dist.Normal(0.0, 0.005)),
    "gripper_scale": criticism.Extension(dist.Normal(0.0, 0.1)),
}
"""What the model may lack, and knows of."""

OUTSIDE = {
    "rotation": criticism.Extension(dist.Normal(0.0, 0.2)),
    "slosh": criticism.Extension(dist.Normal(0.0, 5.0)),
    "swirl": criticism.Extension(dist.Normal(0.0, 50.0)),
    "settling": criticism.Extension(dist.HalfNormal(0.15)),
}
"""What it may lack, and does not know of."""

_NAMES = (*PRIOR.names, *EXTENSIONS, *OUTSIDE)


@dataclass(frozen=True)
class Stir:
    """A path of the gripper; `simulate` is what `inference` calls."""

    points: int = 9
    radius: float = 0.025
    speed: float = 0.1

    @property
    def time(self) -> np.ndarray:
        """Of the samples [s], shape [240]."""
        return np.arange(0.0, DURATION, 1.0 / 30.0)

    def simulate(self, theta: Columns, seeds: np.ndarray) -> np.ndarray:
        """Inclinations [b, 240, 2] in rad, each with the error of its seed."""
        return self.expected(theta) + np.stack([self._jitter(seed) for seed in seeds])

    def expected(self, theta: Columns) -> np.ndarray:
        """Without the error of a seed."""
        return in_lanes(partial(_swing, jnp.asarray(self._driven)), _NAMES, theta)

    def observe(self, theta: Mapping[str, float], seed: int) -> np.ndarray:
        """What cameras see of one more stir, [240, 2] in rad."""
        rng = np.random.default_rng([seed, 1])
        return self.simulate(alone(theta), np.array([seed]))[0] + camera_noise(rng, len(self.time))

    def covariance(self, theta: Mapping[str, float]) -> np.ndarray:
        """Of the cameras' noise and of a run's error [480, 480], while the liquid moves."""
        samples = np.arange(len(self.time))
        lag = np.abs(np.subtract.outer(samples, samples))
        smooth = np.exp(-0.5 * (lag / (30.0 * JITTER_TIME)) ** 2)
        return np.kron(NOISE**2 * CORRELATION**lag + JITTER**2 * smooth, np.eye(2))

    def _jitter(self, seed: int) -> np.ndarray:
        white = np.random.default_rng([int(seed), 2]).normal(size=(len(self.time), 2))
        smooth = gaussian_filter1d(white, JITTER_TIME * 30.0 / np.sqrt(2.0), axis=0, mode="wrap")
        size = JITTER * np.sqrt(2.0 * np.sqrt(np.pi) * JITTER_TIME * 30.0 / np.sqrt(2.0))
        stirred = np.clip((self.time - REST) / 0.5, 0.0, 1.0)  # liquid at rest is quiet
        return size * stirred[:, None] * smooth

    @property
    def _driven(self) -> np.ndarray:
        return _driven(self.points, self.radius, self.speed)


def camera_noise(rng: np.random.Generator, samples: int) -> np.ndarray:
    """AR(1) noise [samples, 2] in rad."""
    white = rng.normal(size=(samples, 2)) * NOISE
    for i in range(1, samples):
        white[i] = CORRELATION * white[i - 1] + np.sqrt(1.0 - CORRELATION**2) * white[i]
    return white


@cache
def _driven(points: int, radius: float, speed: float) -> np.ndarray:
    """Position, velocity and acceleration of the gripper at each substep, [substeps, 6]."""
    path = star(speed=speed, height=0.235, radius=radius, points=points, rest=REST)
    fine = np.arange(0.0, DURATION, 1.0 / (30.0 * SUBSTEPS))
    place = np.stack([np.interp(fine, path.time, path.position[:, k]) for k in range(2)], 1)
    place = gaussian_filter1d(place, 0.04 * 30.0 * SUBSTEPS, axis=0, mode="nearest")
    step = 1.0 / (30.0 * SUBSTEPS)
    velocity = np.gradient(place, step, axis=0)
    return np.column_stack([place, velocity, np.gradient(velocity, step, axis=0)]).astype(
        np.float32
    )


@jax.jit
def _swing(driven: jax.Array, values: jax.Array) -> jax.Array:
    return jax.vmap(partial(_one, driven))(values)


def _one(driven: jax.Array, values: jax.Array) -> jax.Array:
    """Seen angles [240, 2] of one stir."""
    of = dict(zip(_NAMES, values, strict=True))
    step = 1.0 / (30.0 * SUBSTEPS)
    inertia = LENGTH**2 / 3.0
    weight = GRAVITY * LENGTH / 2.0
    lift = GRAVITY * LENGTH / 2.0 * BUOYANCY * (1.0 + 2.0 * of["fill"])
    lever = WET * LENGTH

    def advance(now, row):
        angle, rate, flow, wave, time = now
        place, velocity, acceleration = row[:2], row[2:4], row[4:]
        scale = 1.0 + of["gripper_scale"]
        place, velocity, acceleration = scale * place, scale * velocity, scale * acceleration
        tip = velocity + lever * rate
        slip = tip - flow - wave[0]
        fast = jnp.sqrt(jnp.sum(slip**2) + 1e-6)
        away = jnp.sum((place + lever * angle) ** 2) / 0.04**2
        drag = of["drag"] * (1.0 + of["fill"]) * (1.0 + of["wall"] * away**2)
        drag = drag * (1.0 + fast / 0.05) ** -of["thinning"] * (1.0 - 0.3 * of["settling"] * time)
        swirl = of["swirl"] * jnp.exp(-time / 1.5) * jnp.stack([-place[1], place[0]])
        torque = lift * jnp.sin(angle) - weight * jnp.sin(angle)
        torque = torque - LENGTH / 2.0 * jnp.cos(angle) * acceleration
        torque = torque - 0.01 * of["friction"] * jnp.tanh(rate / RUB)
        torque = torque + drag * lever * 0.05 * (flow + wave[0] + swirl - velocity)
        damping = drag * lever**2 * 0.05
        rate = (rate + step * torque / inertia) / (1.0 + step * damping / inertia)
        angle = angle + step * rate
        flow = flow + step / EDDY * (of["eddy"] * tip - flow)
        push = of["slosh"] * acceleration - SLOSH**2 * wave[1] - 0.6 * wave[0]
        wave = jnp.stack([wave[0] + step * push, wave[1] + step * (wave[0] + step * push)])
        return (angle, rate, flow, wave, time + step), angle

    zero = jnp.zeros(2)
    start = (zero, zero, zero, jnp.zeros((2, 2)), jnp.asarray(0.0))
    angles = jax.lax.scan(advance, start, driven)[1]
    return _seen(angles, of)


def _seen(angles: jax.Array, of: dict[str, jax.Array]) -> jax.Array:
    """By cameras that are late, turned, tilted and drifting."""
    fine = jnp.arange(len(angles)) / (30.0 * SUBSTEPS)
    time = fine[::SUBSTEPS]
    late = jnp.stack([jnp.interp(time - of["delay"], fine, angles[:, k]) for k in range(2)], 1)
    cos, sin = jnp.cos(of["rotation"]), jnp.sin(of["rotation"])
    turned = jnp.stack(
        [cos * late[:, 0] - sin * late[:, 1], sin * late[:, 0] + cos * late[:, 1]], 1
    )
    tilt = jnp.stack([of["tilt"], jnp.asarray(0.0)])
    return turned + tilt + of["drift"] * time[:, None]


def rest_noise(observed: list[np.ndarray]) -> criticism.Noise:
    """The cameras' noise, from the rests of several data sets, as for recordings."""
    return criticism.rest_noise([one[: int(REST * 30)] for one in observed], trend=2)


SUBJECT = Subject(
    name="stir",
    prior=PRIOR,
    extensions=EXTENSIONS,
    outside=OUTSIDE,
    fitted=Stir(),
    held_out=Stir(points=7, radius=0.02, speed=0.08),
    noise=rest_noise,
    settings="inclination [rad] in two planes, 30 samples a second, at rest for 2 s; fitted: a "
    "star of 9 points, 25 mm and 0.1 m/s; held out: 7 points, 20 mm and 0.08 m/s",
)
