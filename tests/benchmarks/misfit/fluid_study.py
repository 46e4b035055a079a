"""How often criticism is right on the particle fluid itself.

    python tests/benchmarks/misfit/fluid_study.py --out fluid_study

Effects are hidden in stirs and pours that were simulated with more particles than the model has,
and other seeds; stirs are criticised beside clean ones of other liquids. The folder keeps every
simulation and result: a study that was interrupted goes on where it stopped.
"""

import argparse
import json
import sys
import time
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import numpyro.distributions as dist

from bolfi_liquids import hardware as paths

sys.path.insert(0, str(Path(__file__).parent))

from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.simulations import Compute
from kept import keep, results

from bolfi_liquids import inference, models
from bolfi_liquids.calibration.model_error import Clean, clean_residuals, model_error
from bolfi_liquids.calibration.stirs import (
    camera_noise,
    effects_of,
    held_out_noise,
    stir_experiment,
)
from bolfi_liquids.criticism.pours import REPEATABILITY_SD, Fractions
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.inputs.recording import Recording, Trajectory
from bolfi_liquids.inputs.settings import CriticismSettings
from bolfi_liquids.simulators import PourSimulator, StirSimulator, stir_simulator

RIG = {
    "cup_radius": 0.04,
    "cup_height": 0.075,
    "fill": 0.05,
    "stick_radius": 0.0045,
    "stick_length": 0.22,
    "stick_density": 1200.0,
    "liquid_density": 1200.0,
}
MODEL, DATA = 600, 1000  # particles
POURED = 900  # particles of the pours that are data; the model has its usual number
NOISE, CORRELATION = np.radians(0.1), 0.5
NULLS, SETS, CLEAN = 20, 5, 4
VISCOSITY = 0.4, 1.2  # Pa s, of the truths
THIN = {"pivot_friction": (0.06, 0.12)}  # Pa s, where thicker liquid hides an effect
EFFECTS = {
    "camera_delay": (0.03, 0.06),
    "camera_tilt": (0.015, 0.025),
    "camera_rotation": (0.2, 0.28),
    "pivot_friction": (11e-4, 13e-4),
    "gripper_scale": (1.16, 1.25),
}
"""Hidden in stirs: sizes with which these stirs could show them, with either sign where an effect
has both. Stick mass, fill level, warming and yield stress stay below a signal-to-noise ratio of ten
here, as large as their priors allow."""
SIGNED = ("camera_delay", "camera_rotation", "camera_tilt")
ADHESION = 0.3, 0.8  # hidden in pours
PATHS = {
    "star": paths.star(points=5, radius=0.022, speed=0.12, height=0.235, rest=1.0),
    "circle": paths.circle(radius=0.018, speed=0.1, turns=3.0, height=0.235, rest=1.0),
}
ACTIONS = np.array([(w, d) for w in (45.0, 90.0) for d in (0.5, 1.5, 2.5, 4.0)])

Set = tuple[str, int]
"""Effect ("" for none), number."""


def all_sets() -> list[Set]:
    """Every data set, the kinds interleaved."""
    sets = [("", i) for i in range(NULLS)]
    sets += [(name, i) for name in (*EFFECTS, "adhesion") for i in range(SETS)]
    return sorted(sets, key=lambda one: one[1] / (SETS if one[0] else NULLS))


def examine(one: Set, bank: inference.SimulationBank) -> dict:
    """Make a data set, criticise the base model on it, and say how that went."""
    effect, number = one
    started = time.perf_counter()
    rng = np.random.default_rng([number, *effect.encode()])
    truth = {
        "viscosity": float(np.exp(rng.uniform(*np.log(THIN.get(effect, VISCOSITY))))),
        "cohesion": float(rng.uniform(0.1, 0.9)),
    }
    if effect == "adhesion":
        truth[effect] = float(rng.uniform(*ADHESION))
        found = _criticised_pours(truth, rng, bank)
    else:
        if effect:
            sign = rng.choice([-1.0, 1.0]) if effect in SIGNED else 1.0
            truth[effect] = float(sign * rng.uniform(*EFFECTS[effect]))
        found = _criticised_stirs(truth, rng, bank)
    gaps = found.gaps.get(found.accepted, ())
    return {
        "effects": [effect] if effect else [],
        "number": number,
        "theta": truth,
        "snr": _snr(found, effect, truth) if effect else 0.0,
        "p_value": found.base.check.p_value,
        "verdict": found.verdict.kind,
        "named": list(found.verdict.effects),
        "probabilities": dict(found.probabilities),
        "intervals": {name: list(interval) for name, interval in found.coefficients.items()},
        "gaps": [[gap.before, gap.after, gap.noise] for gap in gaps],
        "simulations": found.simulations,
        "seconds": time.perf_counter() - started,
    }


def _criticised_stirs(
    truth: dict, rng: np.random.Generator, bank: inference.SimulationBank
) -> criticism.Criticism:
    usual = _clean(bank)
    star, circle = (_record(path, truth, rng) for path in PATHS)

    def experiment(recording: Recording, cameras: criticism.AutoregressiveNoise):
        stirring = stir_simulator([recording], MODEL)
        name = recording.path.stem
        error = model_error(stirring, truth["viscosity"], usual)
        return stir_experiment(stirring, cameras, error, name)

    return criticism.criticise(
        experiment(star, camera_noise([star])),
        default_prior(),
        effects_of("stir"),
        held_out=[experiment(circle, held_out_noise(circle, [star]))],
        plan=CriticismSettings().stir_plan,
        bank=bank,
    )


def _record(path: str, truth: dict, rng: np.random.Generator) -> Recording:
    """A simulated stir with cameras' noise."""
    gripper = Trajectory(*PATHS[path])
    recording = _recording(path, np.zeros((len(gripper.time), 2)))
    own = StirSimulator((recording,), (models.StirSetup.from_recording(recording, particles=DATA),))
    theta = {name: np.array([value]) for name, value in truth.items()}
    angles = own.simulate(theta, rng.integers(2**31, size=1))[0]
    noise = rng.normal(size=angles.shape) * NOISE
    for i in range(1, len(noise)):
        noise[i] = CORRELATION * noise[i - 1] + np.sqrt(1.0 - CORRELATION**2) * noise[i]
    return _recording(path, angles + noise)


def _recording(path: str, inclination: np.ndarray) -> Recording:
    gripper = Trajectory(*PATHS[path])
    label = f"{path}-{hash(inclination.tobytes())}"
    return Recording(gripper.time, gripper, inclination, RIG, Path(f"{path}.nc"), label)


@cache
def _clean(bank: inference.SimulationBank) -> list[Clean]:
    """Stirs of other liquids that lack nothing, along both paths."""
    rng = np.random.default_rng(0)
    truths = [
        {"viscosity": float(np.exp(rng.uniform(*np.log(VISCOSITY)))), "cohesion": rng.uniform()}
        for _ in range(CLEAN)
    ]
    recordings = [_record(path, truth, rng) for truth in truths for path in PATHS]
    return clean_residuals(
        recordings,
        MODEL,
        default_prior(),
        compute=Compute(batch=4, bank=bank),
        report=lambda *_: None,
    )


def _criticised_pours(
    truth: dict, rng: np.random.Generator, bank: inference.SimulationBank
) -> criticism.Criticism:
    """As after a stir that told the viscosity within a fifth, and nothing of the cohesion."""
    told = np.log(truth["viscosity"]) + 0.2 * rng.normal()
    prior = inference.Prior(
        {"viscosity": dist.LogNormal(told, 0.2), "cohesion": dist.Uniform(0.0, 1.0)}
    )
    return criticism.criticise(
        _poured(ACTIONS, truth, rng),
        prior,
        effects_of("pour"),
        held_out=[_poured(ACTIONS + [30.0, 0.3], truth, rng)],
        plan=CriticismSettings().pour_plan,
        bank=bank,
    )


def _poured(actions: np.ndarray, truth: dict, rng: np.random.Generator) -> criticism.Experiment:
    from bolfi_liquids.inputs.cups import bundled_cups

    rate, distance = np.radians(actions[:, 0]), actions[:, 1] / 100.0
    cups = bundled_cups()
    actions = Fractions(rate, distance)
    pouring = PourSimulator(cups, RIG["liquid_density"], actions)
    liquid = models.Liquid(truth["viscosity"], truth["cohesion"], density=RIG["liquid_density"])
    made = models.pour(
        liquid,
        models.PourAction(rate, distance),
        cups,
        rng.integers(2**31, size=len(rate)),
        particles=POURED,
        effects={"adhesion": truth["adhesion"]},
    )
    observed = np.stack([made.spilled, made.retained]) + 0.005 * rng.normal(size=(2, len(rate)))
    noise = criticism.KnownNoise(REPEATABILITY_SD)
    return criticism.Experiment(pouring.simulate, observed, noise, pouring.identity, "pours")


def _snr(found: criticism.Criticism, effect: str, truth: dict) -> float:
    """Of the effect at its true size, as the emulator of its model sees it."""
    base = found.base.hypothesis
    candidate = found.singles.get(effect)
    extended = candidate.hypothesis if candidate else found.base.singles[effect]
    neutral = effects_of("stir" if effect != "adhesion" else "pour")[effect].neutral
    theta = extended.best
    u = [extended.fit.prior.to_unit({**theta, effect: at}) for at in (truth[effect], neutral)]
    with_it, without = extended.expected(np.stack(u))
    return float(np.linalg.norm(base.project(base.whiten(with_it - without))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("fluid_study"))
    folder = parser.parse_args().out
    folder.mkdir(exist_ok=True)
    kept = folder / "results.jsonl"
    done = {("".join(r["effects"]), r["number"]) for r in results(kept)}
    with inference.SimulationBank(folder / "simulations.sqlite") as bank:
        for one in all_sets():
            if one not in done:
                result = examine(one, bank)
                keep(kept, result)
                print(json.dumps(result), flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore", models.FailedSimulation)
    main()
