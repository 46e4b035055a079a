"""How often criticism is right: 1196 data sets of the stand-in simulator.

    python tests/benchmarks/misfit/study.py --out study.jsonl --workers 2

Each line of the file is one data set; a study that was interrupted goes on where it stopped.
`table.py` makes a table of it.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares, root_scalar

sys.path.insert(0, str(Path(__file__).parent))

import stand_in
from bolfi_liquids.inference import criticism
from kept import keep, results
from stand_in import EXTENSIONS, NOISE, PRIOR, REST, UNKNOWN, Stir

STRENGTHS = (2.5, 6.0)  # RMS of what the effect changes, over the cameras' noise
NULLS, SETS, OUTSIDE_SETS = 300, 50, 12
FIRST, SECOND = Stir(), Stir(points=7, radius=0.02, speed=0.08)
LARGEST = 0.99  # quantile of a coefficient's prior: what is stronger is not looked for
DRAWS = 8  # of a posterior, for its expectation
MOVES = int(REST * 30)  # the first sample of which the gripper moves
TREND = 2  # degree of what noise at rest is told from, as for recordings

Set = tuple[str, float, int]
"""Effect ("" for none), strength, number."""


def all_sets() -> list[Set]:
    """Every data set, the kinds interleaved, so that an early table shows all of them."""
    sets = [("", 0.0, i) for i in range(NULLS)]
    for strength in STRENGTHS:
        sets += [(name, strength, i) for name in EXTENSIONS for i in range(SETS)]
        sets += [(name, strength, i) for name in UNKNOWN for i in range(OUTSIDE_SETS)]
    return sorted(sets, key=lambda one: one[2] / (SETS if one[0] else NULLS))


def examine(one: Set) -> dict:
    """Make a data set, criticise the base model on it, and say how that went."""
    started = time.perf_counter()
    effect, strength, number = one
    seed = int(
        np.random.SeedSequence([number, int(10 * strength), *effect.encode()]).generate_state(1)[0]
        >> 1
    )
    rng = np.random.default_rng(seed)
    base = {"drag": float(np.exp(rng.uniform(*np.log([0.8, 5.0])))), "eddy": rng.uniform(0.1, 0.5)}
    coefficient = _coefficient(base, effect, strength, rng) if effect else 0.0
    truth = {**base, effect: coefficient} if effect else base
    seed, *seeds = (int(one) for one in rng.integers(2**31, size=3))

    first, second = FIRST.observe(truth, seeds[0]), SECOND.observe(truth, seeds[1])

    def experiment(stir: Stir, label: str, observed: np.ndarray, *more: np.ndarray):
        rests = [each[:MOVES] for each in (observed, *more)]
        noise = criticism.rest_noise(rests, seed=number, trend=TREND)
        return criticism.Experiment(stir.simulate, observed, noise, label, label)

    found = criticism.criticise(
        experiment(FIRST, "star", first),
        PRIOR,
        EXTENSIONS,
        held_out=[experiment(SECOND, "other star", second, first)],
        batch=64,
        seed=seed,
    )
    return {
        "effect": effect,
        "strength": strength,
        "number": number,
        "snr": _snr(base, effect, coefficient) if effect else 0.0,
        "p_value": found.base.check.p_value,
        "verdict": found.verdict.kind,
        "effects": list(found.verdict.effects),
        "named": _before_held_out(found),
        "coefficient": coefficient,
        "interval": list(found.coefficients[effect]) if effect in found.accepted else None,
        "gap": _gap(found, truth),
        "simulations": found.simulations,
        "seconds": time.perf_counter() - started,
    }


def _coefficient(base: dict, effect: str, strength: float, rng: np.random.Generator) -> float:
    """At which the effect changes the inclination by `strength` times the cameras' noise, or the
    greatest that its prior thinks possible."""
    extension = EXTENSIONS.get(effect)
    two_sided = extension is None or np.isinf(float(extension.prior.icdf(1e-30)))
    sign = float(rng.choice([-1.0, 1.0])) if two_sided and effect != "settling" else 1.0
    greatest = np.inf if extension is None else float(extension.prior.icdf(LARGEST))
    low, high = 0.0, 1e-4
    while _change(base, effect, sign * high) < strength:
        if high >= greatest:
            return sign * greatest
        low, high = high, min(2.0 * high, greatest)
    size = root_scalar(
        lambda c: _change(base, effect, sign * c) - strength, bracket=(low, high), rtol=1e-3
    ).root
    return sign * float(size)


def _change(base: dict, effect: str, coefficient: float) -> float:
    clean, changed = _exact(FIRST, base), _exact(FIRST, {**base, effect: coefficient})
    return float(np.sqrt(np.mean((changed - clean) ** 2))) / NOISE


def _exact(stir: Stir, theta: dict) -> np.ndarray:
    return stir.exact({name: np.array([value]) for name, value in theta.items()}, 1)[0]


def _snr(base: dict, effect: str, coefficient: float) -> float:
    """Of the effect, less what the base parameters absorb, by the true covariance."""
    changed = _exact(FIRST, {**base, effect: coefficient})
    whitener = np.linalg.inv(np.linalg.cholesky(stand_in.covariance()))

    def left(at: np.ndarray) -> np.ndarray:
        theta = {"drag": float(np.exp(at[0])), "eddy": float(at[1])}
        return (whitener @ (changed - _exact(FIRST, theta))).ravel()

    ends = [np.log(0.3), 0.0], [np.log(10.0), 0.6]
    start = [np.log(base["drag"]), base["eddy"]]
    return float(np.sqrt(2.0 * least_squares(left, start, bounds=ends, diff_step=0.02).cost))


def _before_held_out(found: criticism.Criticism) -> list[list[str]]:
    """The explanations that went to the held-out data."""
    return [list(names) for names in found.gaps]


def _gap(found: criticism.Criticism, truth: dict) -> list[float] | None:
    """RMS of truth less expected on the held-out stir, without any noise: before, after [deg]."""
    if found.extended is None:
        return None
    seen = _exact(SECOND, truth)
    posteriors = criticism.weighted_posterior(found.base.hypothesis), found.posterior
    expected = [SECOND.exact(each.draw(0, DRAWS), DRAWS).mean(0) for each in posteriors]
    return [float(np.rad2deg(np.sqrt(np.mean((seen - one) ** 2)))) for one in expected]


def run(path: Path, workers: int) -> Iterator[dict]:
    """Finish the study; yields each data set's result as it is kept."""
    done = {(r["effect"], r["strength"], r["number"]) for r in results(path)}
    left = [one for one in all_sets() if one not in done]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for result in pool.map(examine, left, chunksize=4):
            keep(path, result)
            yield result


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("study.jsonl"))
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    total = len(all_sets())
    for count, _ in enumerate(run(asked.out, asked.workers), len(results(asked.out)) + 1):
        print(f"\r{count} of {total}", end="", file=sys.stderr, flush=True)
