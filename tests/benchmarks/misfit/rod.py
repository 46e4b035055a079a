"""A rod that is heated at one end, with four sensors, and effects that it may lack.

Finite differences in one dimension; deterministic, with sensors' noise of known size.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.inference import criticism
from subject import Columns, Subject, alone, in_lanes

from bolfi_liquids import inference

CELLS, WIDTH = 16, 0.02  # cells of the rod, and each one's width [m]
SENSORS = np.array([0.05, 0.11, 0.17, 0.27])  # m from the heated end
SAMPLES, EVERY, STEP = 60, 15.0, 0.75  # samples, seconds between them, seconds of a step
NOISE = 0.05  # K, of a sensor

PRIOR = inference.Prior(
    {"diffusivity": dist.LogUniform(4e-5, 1.5e-4), "loss": dist.LogUniform(5e-4, 4e-3)},
    {"diffusivity": "m2/s", "loss": "1/s"},
)

EXTENSIONS = {
    "heater": criticism.Extension(dist.Normal(0.0, 0.06)),
    "contact": criticism.Extension(dist.HalfNormal(8.0), unit="s"),
    "lag": criticism.Extension(dist.HalfNormal(5.0), unit="s"),
    "ambient": criticism.Extension(dist.Normal(0.0, 1.0), unit="K"),
    "radiation": criticism.Extension(dist.HalfNormal(0.8)),
    "conductivity": criticism.Extension(dist.Normal(0.0, 0.2)),
    "end_leak": criticism.Extension(dist.HalfNormal(0.004), unit="1/s"),
    "position": criticism.Extension(dist.Normal(0.0, 0.004), unit="m"),
}
"""The heater gives more; its heat comes through a bad contact; the sensors lag; the room warms up;
hot cells lose more; hot cells conduct better; the far end leaks; the sensors sit elsewhere."""

OUTSIDE = {
    "crack": criticism.Extension(dist.HalfNormal(1.0)),
    "draught": criticism.Extension(dist.HalfNormal(0.5)),
    "side_heat": criticism.Extension(dist.HalfNormal(0.008), unit="K/s"),
    "melting": criticism.Extension(dist.HalfNormal(1.0)),
}
"""Heat passes badly between two cells; a window is open for a while; something warms the middle;
cells take up heat while they melt."""

NAMES = (*PRIOR.names, *EXTENSIONS, *OUTSIDE)


@dataclass(frozen=True)
class Heating:
    """A schedule of the heater; `simulate` is what `inference` calls.

    Attributes:
        power: Of the heated cell [K/s].
        on: Stretches of heating [s].
    """

    power: float
    on: tuple[tuple[float, float], ...]

    def simulate(self, theta: Columns, seeds: np.ndarray) -> np.ndarray:
        """Temperatures [b, 60, 4] above the room's [K]; seeds change nothing."""
        return self.expected(theta)

    def expected(self, theta: Columns) -> np.ndarray:
        """The same."""
        time = np.arange(0.0, SAMPLES * EVERY, STEP)
        heating = sum((time >= start) & (time < stop) for start, stop in self.on)
        heat = jnp.asarray((self.power * heating).astype(np.float32))
        return in_lanes(partial(_warm, heat), NAMES, theta)

    def observe(self, theta: Mapping[str, float], seed: int) -> np.ndarray:
        """What the sensors show, [60, 4] in K."""
        clean = self.expected(alone(theta))[0]
        return clean + NOISE * np.random.default_rng([seed, 1]).normal(size=clean.shape)

    def covariance(self, theta: Mapping[str, float]) -> np.ndarray:
        """Independent, whatever theta [240, 240]."""
        return NOISE**2 * np.eye(SAMPLES * len(SENSORS))


@jax.jit
def _warm(heat: jax.Array, values: jax.Array) -> jax.Array:
    return jax.vmap(partial(_one, heat))(values)


def _one(heat: jax.Array, values: jax.Array) -> jax.Array:
    """Seen temperatures [60, 4] of one run."""
    of = dict(zip(NAMES, values, strict=True))
    cracked = jnp.where(jnp.arange(CELLS - 1) == 4, 1.0 / (1.0 + of["crack"]), 1.0)
    middle = jnp.where(jnp.arange(CELLS) == 8, 1.0, 0.0)
    end = jnp.where(jnp.arange(CELLS) == CELLS - 1, 1.0, 0.0)

    def advance(now, power):
        cells, given, shown, time = now
        given = given + STEP * (power - given) / (STEP + of["contact"])
        between = 0.5 * (cells[1:] + cells[:-1])
        better = jnp.exp(of["conductivity"] * jnp.tanh(between / 50.0)) * cracked
        flow = of["diffusivity"] * better * (cells[1:] - cells[:-1]) / WIDTH**2
        room = of["ambient"] * time / (SAMPLES * EVERY)
        open_window = 1.0 + of["draught"] * ((time > 300.0) & (time < 450.0))
        loss = of["loss"] * open_window * (1.0 + of["radiation"] * cells / 50.0)
        loss = loss + of["end_leak"] * end
        change = jnp.pad(flow, (0, 1)) - jnp.pad(flow, (1, 0)) - loss * (cells - room)
        change = change.at[0].add((1.0 + of["heater"]) * given) + of["side_heat"] * middle
        takes = 1.0 + of["melting"] * jnp.exp(-0.5 * ((cells - 20.0) / 3.0) ** 2)
        cells = cells + STEP * change / takes
        at = (jnp.asarray(SENSORS) + of["position"]) / WIDTH - 0.5
        felt = jnp.interp(at, jnp.arange(CELLS, dtype=jnp.float32), cells)
        shown = shown + STEP * (felt - shown) / (STEP + of["lag"])
        return (cells, given, shown, time + STEP), shown

    zero = jnp.zeros((), jnp.float32)
    start = (jnp.zeros(CELLS, jnp.float32), zero, jnp.zeros(len(SENSORS), jnp.float32), zero)
    every = int(EVERY / STEP)
    return jax.lax.scan(advance, start, heat)[1][every - 1 :: every]


SUBJECT = Subject(
    name="rod",
    prior=PRIOR,
    extensions=EXTENSIONS,
    outside=OUTSIDE,
    fitted=Heating(0.5, ((0.0, 300.0), (500.0, 600.0))),
    held_out=Heating(0.8, ((100.0, 200.0), (300.0, 400.0), (700.0, 800.0))),
    noise=lambda _: criticism.KnownNoise(NOISE),
    settings="temperature above the room's [K] every 15 s, 0.05, 0.11, 0.17 and 0.27 m from the "
    "heated end of a rod of 0.32 m; fitted: 0.5 K/s from 0 to 300 s and from 500 to 600 s; held "
    "out: 0.8 K/s from 100 to 200, 300 to 400 and 700 to 800 s",
)
