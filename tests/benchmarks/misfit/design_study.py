"""How often the proposed experiment resolves a tie: data sets of the stand-in simulator.

    python tests/benchmarks/misfit/design_study.py --out design.jsonl --ties 40

An effect is hidden at a size at which the first star leaves a tie with another. Then the proposed
stir is made, one drawn from the same family, and the same star again; each is held out in turn. The
proposed one is also fitted together with the first.
Each line of the file is one data set; a study that was interrupted goes on where it stopped.
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from itertools import count
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import stand_in
from bolfi_liquids.hardware.motion import circle, star
from bolfi_liquids.inference import SimulationBank, criticism
from bolfi_liquids.inference.sobol import sobol
from kept import keep, results
from scipy.ndimage import gaussian_filter1d
from stand_in import DURATION, EXTENSIONS, PRIOR, REST, SUBSTEPS, Stir

MOVES = int(REST * 30)  # the first sample of which the gripper moves
TREND = 2  # degree of what noise at rest is told from, as for recordings
MOST_ALIKE = 10  # ties in which one effect is hidden
MIN_LIKENESS = 0.6  # cosine of the hidden effect's signature and another's on the first star
SNRS = (4.0, 7.0)  # of the hidden effect, by the true covariance
TRIES = 60  # of the noise, until a linear analysis expects a tie
MIN_GAIN, TIE_GAIN = 8.0, 2.0  # log likelihood of the best, and by which another is behind
FAMILY = 8  # motions that are proposed
ARMS = ("proposed", "drawn", "same again")
HELD_OUT, FITTED = "held out", "fitted too"


@dataclass(frozen=True)
class Motion(Stir):
    """A path of the family: a star, a line (2 points) or a circle (0), with pauses at vertices."""

    pause: float = 0.0

    @property
    def label(self) -> str:
        """All that fixes it."""
        return f"{self.points} {self.radius:.4f} {self.speed:.3f} {self.pause:.1f}"

    @property
    def _driven(self) -> np.ndarray:
        return _driven(self)


@cache
def _driven(motion: Motion) -> np.ndarray:
    """Position, velocity and acceleration of the gripper at each substep, [substeps, 6]."""
    sizes = {"speed": motion.speed, "height": 0.235, "radius": motion.radius, "rest": REST}
    if motion.points:
        path = star(points=motion.points, pause=motion.pause, cycles=20, **sizes)
    else:
        path = circle(turns=20.0, **sizes)
    step = 1.0 / (30.0 * SUBSTEPS)
    fine = np.arange(0.0, DURATION, step)
    place = np.stack([np.interp(fine, path.time, path.position[:, k]) for k in range(2)], 1)
    place = gaussian_filter1d(place, 0.04 * 30.0 * SUBSTEPS, axis=0, mode="nearest")
    velocity = np.gradient(place, step, axis=0)
    return np.column_stack([place, velocity, np.gradient(velocity, step, axis=0)]).astype(
        np.float32
    )


def family() -> list[Motion]:
    """Motions all over the family."""
    motions = []
    for k, (r, v, p) in enumerate(sobol(0, 0, FAMILY, 3).tolist()):
        points = (9, 0, 2, 5)[k % 4]
        pause = round(max(0.0, 1.2 * p - 0.6), 1) if points else 0.0
        motions.append(Motion(points, 0.01 + 0.015 * r, 0.05 + 0.1 * v, pause))
    return motions


def white(signals: np.ndarray) -> np.ndarray:
    """Signals [n, 240, 2] -> [n, 480] of unit covariance."""
    factor = np.linalg.cholesky(stand_in.covariance())
    return np.linalg.solve(factor, signals).reshape(len(signals), -1)


def data_set(number: int, effect: str) -> dict | None:
    """Motion, truth and data of a set of which a linear analysis expects a tie with the hidden
    effect; None where there is none."""
    rng = np.random.default_rng([number, 7])
    first = Motion(9, rng.uniform(0.01, 0.025), rng.uniform(0.03, 0.15))
    base = {"drag": float(np.exp(rng.uniform(*np.log([0.8, 5.0])))), "eddy": rng.uniform(0.1, 0.5)}
    sizes = {name: float(one.prior.icdf(0.6)) for name, one in EXTENSIONS.items()}
    at = [base, base | {"drag": 1.05 * base["drag"]}, base | {"eddy": base["eddy"] + 0.02}]
    at += [base | {name: size} for name, size in sizes.items()]
    changed = white(exact(first, at) - exact(first, at[:1]))[1:]
    absorbed, _ = np.linalg.qr(changed[:2].T)

    def visible(rows: np.ndarray) -> np.ndarray:
        return rows - (rows @ absorbed) @ absorbed.T

    signature = dict(zip(EXTENSIONS, visible(changed[2:]), strict=True))
    one_sided = {name: float(of.prior.icdf(1e-9)) >= 0.0 for name, of in EXTENSIONS.items()}
    sign = 1.0 if one_sided[effect] else float(rng.choice([-1.0, 1.0]))
    goal, most = rng.uniform(*SNRS), float(EXTENSIONS[effect].prior.icdf(0.99))
    coefficient = sign * sizes[effect] * goal / np.linalg.norm(signature[effect])
    truth = base | {effect: coefficient}
    clean, (unmoved,) = exact(first, [base, truth])[1], exact(first, [base])
    (moved,) = white(clean[None] - unmoved)
    unit = {name: of / np.linalg.norm(of) for name, of in signature.items()}
    likeness = max(abs(unit[effect] @ of) for name, of in unit.items() if name != effect)
    taken = base["eddy"] + 0.02 * np.linalg.lstsq(changed[:2].T, moved, rcond=None)[0][1]
    if likeness < MIN_LIKENESS or abs(coefficient) > most or not 0.0 < taken < 0.6:
        return None
    if not SNRS[0] < np.linalg.norm(visible(moved)) < SNRS[1]:
        return None
    for seed in range(TRIES * number, TRIES * (number + 1)):
        observed = observe(first, clean, seed)
        (left,) = visible(white(observed[None] - unmoved))
        score = {name: of @ left for name, of in unit.items()}
        gain = {n: max(z, 0.0 if one_sided[n] else -z) ** 2 / 2.0 for n, z in score.items()}
        best = max(gain.values())
        near = [name for name, value in gain.items() if value > best - TIE_GAIN]
        if best > MIN_GAIN and effect in near and len(near) > 1:
            return {"first": first, "effect": effect, "truth": truth, "observed": observed}
    return None


def exact(stir: Stir, at: list[dict]) -> np.ndarray:
    """Without any noise [n, 240, 2]."""
    names = {name for one in at for name in one}
    return stir.exact({n: np.array([one.get(n, 0.0) for one in at]) for n in names}, len(at))


def observe(stir: Stir, clean: np.ndarray, seed: int) -> np.ndarray:
    """What cameras see of a stir, whose signal without noise is given, [240, 2] in rad."""
    noise = stand_in.camera_noise(np.random.default_rng([seed, 1]), len(clean))
    return clean + stir._jitter(seed, {}) + noise


def simulate_both(first: Stir, second: Stir, theta: dict, seeds: np.ndarray) -> np.ndarray:
    """Two stirs of one liquid, joined along time [b, 480, 2]; their errors are independent."""
    later = second.simulate(theta, np.asarray(seeds) + 2**31)
    return np.concatenate([first.simulate(theta, seeds), later], axis=1)


def examine(number: int, effect: str) -> dict | None:
    """Criticise a data set, and where it leaves a tie make each arm's experiment."""
    made = data_set(number, effect)
    if made is None:
        return None
    first, truth, bank = made["first"], made["truth"], SimulationBank(":memory:")
    motions = {motion.label: motion for motion in family()}
    noise = criticism.rest_noise([made["observed"][:MOVES]], seed=number, trend=TREND)

    star = criticism.Experiment(first.simulate, made["observed"], noise, first.label, "star")

    def criticised(experiment: criticism.Experiment, **more) -> criticism.Criticism:
        how = {"seed": number, "batch": 64, "bank": bank}
        return criticism.criticise(experiment, PRIOR, EXTENSIONS, **how, **more)

    proposals = [
        criticism.Proposal(one.simulate, noise, (240, 2), label, label, DURATION)
        for label, one in motions.items()
    ]
    found = criticised(star, proposals=proposals)
    result = {"number": number, "effect": made["effect"], "verdict": str(found.verdict.kind)}
    result |= {"tied": list(map(list, found.tied)), "simulations": found.simulations}
    if found.verdict.kind != "tie" or (made["effect"],) not in found.tied:
        return result
    rng = np.random.default_rng([number, 8])
    drawn = list(motions.values())[rng.integers(len(motions))]
    best = found.suggestions[0]
    result["suggested"] = best._asdict()
    for arm, motion in zip(ARMS, (motions[best.label], drawn, first), strict=True):
        seen = observe(motion, exact(motion, [truth])[0], 10_000_000 + number)
        rests = [seen[:MOVES], made["observed"][:MOVES]]
        noise_there = criticism.rest_noise(rests, seed=number, trend=TREND)
        label = f"{motion.label} {arm}"
        again = criticism.Experiment(motion.simulate, seen, noise_there, label, arm)
        both = criticism.Experiment(
            partial(simulate_both, first, motion),
            np.concatenate([made["observed"], seen]),
            noise_there,
            f"{first.label} and {label}",
        )
        ways = {HELD_OUT: criticised(star, held_out=[again])}
        if arm == ARMS[0]:
            ways[FITTED] = criticised(both)
        for way, found in ways.items():
            verdict = found.verdict
            result[f"{arm}, {way}"] = [str(verdict.kind), list(verdict.effects), motion.label]
    return result


def right(result: Mapping, arm: str) -> bool:
    """Whether the hidden effect alone was named, of an arm and a way."""
    return result[arm][:2] == ["effect", [result["effect"]]]


def table(found: list[dict]) -> str:
    """What each arm's experiment led to, in Markdown."""
    ties = [one for one in found if "suggested" in one]
    rows = [
        f"{len(ties)} ties",
        "",
        "| stir | right | still tied | unknown | wrong |",
        "|-|-|-|-|-|",
    ]
    for arm in (*(f"{arm}, {HELD_OUT}" for arm in ARMS), f"{ARMS[0]}, {FITTED}"):
        kinds = ["right" if right(one, arm) else one[arm][0] for one in ties]
        shares = [np.mean([kind == of for kind in kinds]) for of in ("right", "tie", "unknown")]
        shares.append(np.mean([kind in ("effect", "none") for kind in kinds]))
        rows.append(f"| {arm} | " + " | ".join(f"{share:.2f}" for share in shares) + " |")
    if ties:
        before, after = (
            np.mean([one["suggested"][when] for one in ties]) for when in ("before", "error")
        )
        rows += ["", f"expected rate of wrong names: {before:.2f} before, {after:.3f} after"]
    return "\n".join(rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("design.jsonl"))
    parser.add_argument("--ties", type=int, default=40)
    asked = parser.parse_args()
    done = results(asked.out)
    for number in count(max((one["number"] for one in done), default=-1) + 1):
        ties = [one["effect"] for one in done if "suggested" in one]
        effect = tuple(EXTENSIONS)[number % len(EXTENSIONS)]
        if len(ties) >= asked.ties:
            break
        if ties.count(effect) < MOST_ALIKE and (result := examine(number, effect)) is not None:
            keep(asked.out, result)
            done.append(result)
    print(table(results(asked.out)))
