"""What coarse stirs beside fine ones save: the error of an emulator of three parameters.

    .venv/bin/python tests/benchmarks/two_fidelities.py --pools 3

Prints a line for each mixture of runs: its seconds, in fine stirs, and the RMS error of the
inclination at held-out fine stirs, geometric mean over pools. A pool takes about a minute.
"""

import argparse
import time
import warnings
from importlib.resources import files
from typing import NamedTuple

import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.inference.sobol import sobol

from bolfi_liquids import inference
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.simulators import TOGETHER, StirSimulator, stir_simulator

PRIOR = inference.Prior(
    {
        "viscosity": dist.LogUniform(3e-4, 20.0),
        "shear_thinning": dist.Uniform(0.0, 0.8),
        "pivot_friction": dist.HalfNormal(5e-4),
    }
)
FINE, COARSE, HELD_OUT = 48, 128, 48
COARSER = 8  # times fewer particles: cells twice as wide, the widest with which every stir ends
CAMERA_NOISE = np.radians(0.1)
MIXTURES = [(n, m) for m in (0, 64, 128) for n in (8, 12, 16, 24, 32, 48)]


class Runs(NamedTuple):
    """Stirs at the points of a Sobol sequence."""

    u: np.ndarray  # [n, d]
    signals: np.ndarray  # [n, T, 2], rad
    seconds: float  # of the processor, each

    def first(self, n: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
        return PRIOR.from_unit(self.u[:n]), self.signals[:n]


def stirred(simulator: StirSimulator, seed: int, n: int) -> Runs:
    u = sobol(seed, 0, n, len(PRIOR.names))
    theta = {**PRIOR.from_unit(u), "cohesion": np.full(n, 0.5)}
    began, parts = time.process_time(), []
    for i in range(0, n, TOGETHER):
        some = slice(i, i + TOGETHER)
        batch = {name: column[some] for name, column in theta.items()}
        parts.append(simulator.simulate(batch, np.arange(n)[some] + 1000 * seed))
    return Runs(u, np.concatenate(parts), (time.process_time() - began) / n)


def error(fine: Runs, coarse: Runs, mixture: tuple[int, int], held_out: Runs) -> float:
    """RMS error [deg] of the emulator of the first fine and coarse runs."""
    n, m = mixture
    observed = held_out.signals[0]  # an emulator does not depend on it
    cheap = coarse.first(m) if m else None
    engine = inference.Bolfi(PRIOR, observed, noise=CAMERA_NOISE, cheap=cheap)
    engine.tell(*fine.first(n))
    mean, _ = engine.fit(warn=False).learned.predict(held_out.u)
    values = engine.family.measure(engine.family.view(observed), held_out.signals).features
    return float(np.degrees(np.sqrt(np.mean((mean - values) ** 2))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pools", type=int, default=3)
    pools = range(parser.parse_args().pools)
    warnings.simplefilter("ignore")  # of cells that no reference was compared with
    recording = open_recording(str(files("bolfi_liquids.data") / "oil_v10.nc"))
    simulator = stir_simulator([recording], 0)
    coarser = stir_simulator([recording], simulator.setups[0].particles // COARSER)
    for one in (simulator, coarser):
        stirred(one, 0, TOGETHER)  # compiles, which is not timed
    held_out = stirred(simulator, 90, HELD_OUT)
    made = [(stirred(simulator, i, FINE), stirred(coarser, 50 + i, COARSE)) for i in pools]
    ratio = np.mean([coarse.seconds for _, coarse in made]) / np.mean([f.seconds for f, _ in made])
    print(f"a fine stir takes {made[0][0].seconds:.2f} s, a coarse one {ratio:.3f} of it")
    for n, m in MIXTURES:
        errors = [error(fine, coarse, (n, m), held_out) for fine, coarse in made]
        found = np.exp(np.mean(np.log(errors)))
        print(f"{n:2} fine + {m:3} coarse = {n + m * ratio:4.1f} fine: {found:.3f} deg")


if __name__ == "__main__":
    main()
