"""Nothing goes wrong anywhere in the prior box; what is made to go wrong is NaN, with a reason."""

import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from bolfi_liquids.models import pouring
from bolfi_liquids.models.fluid import faults, runtime
from bolfi_liquids.models.fluid.runtime import Watch
from bolfi_liquids.models.stirring import watched_stir
from jax import random

from bolfi_liquids import models

INSIDE = 0  # the code of `pouring_kernel`, which loads Taichi
POINTS, BATCH = 500, 25
SOME_EFFECTS = 125  # of the points have a subset of the effects, one for each batch
PARTICLES = {"pour": 300}
FIRST, LAST = 0.5, 4.5  # s of the recording: from rest into strokes at 10 cm/s,
HASTE = 2.0  # times as fast
LOOK = 20  # substeps between two looks at the particles' speeds
FASTEST = {"stir": 2.0, "pour": 4.0}  # m/s; a fall over the cup's depth gains 1.2, a pour's 1.9
STEEPEST = np.radians(60.0)

STARTS = range(0, POINTS, BATCH)


class Points(NamedTuple):
    """Points of the prior box, every array of shape [n]."""

    liquid: models.Liquid
    effects: dict[str, np.ndarray]
    action: models.PourAction
    seeds: np.ndarray

    def text(self, k):
        """What repeats point k."""
        given = {name: float(values[k]) for name, values in self.effects.items()}
        rate, distance = self.action.angular_velocity[k], self.action.distance[k]
        return f"{self.liquid[k]}, {given}, {rate} rad/s, {distance} m, seed {self.seeds[k]}"


def points(start, cups):
    """The batch of points from number `start` on."""
    rng = np.random.default_rng(start)
    names = sorted(models.EFFECTS)
    if start >= POINTS - SOME_EFFECTS:
        names = [name for name in names if rng.random() < 0.5]
    keys = random.split(random.key(start), len(names))
    return Points(
        models.Liquid(
            viscosity=np.exp(rng.uniform(np.log(1e-3), np.log(50.0), BATCH)),
            cohesion=rng.uniform(0.0, 1.0, BATCH),
            density=rng.uniform(700.0, 1400.0, BATCH),
            adhesion=np.zeros(BATCH),  # drawn as the effect of that name
        ),
        {
            name: np.asarray(models.EFFECTS[name].prior.sample(key, (BATCH,)), float)
            for name, key in zip(names, keys, strict=True)
        },
        models.PourAction(
            rng.uniform(*cups.angular_velocity_range, BATCH),
            rng.uniform(*cups.distance_range, BATCH),
        ),
        start + np.arange(BATCH),
    )


class End(NamedTuple):
    """What became of a simulation's particles: where they are [m], [n, 3], how fast one of them
    ever was [m/s], and how many that should be in the pouring cup are past its walls."""

    position: np.ndarray
    fastest: float
    astray: int


class Watched:
    """A scene that notes how fast its particles get."""

    def __init__(self, scene):
        self.scene, self.fastest = scene, np.zeros(scene.slots)

    def __getattr__(self, name):
        return getattr(self.scene, name)

    def pour(self, *how):
        self.scene.pour(*how)
        self._look()

    def end(self, slot):
        alive = self.scene.alive.to_numpy()[slot]
        position = self.scene.position.to_numpy()[slot, :alive].astype(float)
        return End(position, self.fastest[slot], self._astray(slot, position))

    def _astray(self, slot, position):
        if not hasattr(self.scene, "region"):
            return 0
        scene, angle = self.scene, self.scene.angle.to_numpy()[slot]
        x = np.cos(angle) * position[:, 0] - np.sin(angle) * position[:, 2] + scene.cup_radius
        z = np.sin(angle) * position[:, 0] + np.cos(angle) * position[:, 2] + scene.cup_height
        beyond = (np.hypot(x, position[:, 1]) > scene.cup_radius) | (z < 0.0)
        held = scene.region.to_numpy()[slot, : len(position)] == INSIDE
        return int((held & beyond & (z < scene.cup_height)).sum())

    def _look(self):
        speed = np.linalg.norm(self.scene.velocity.to_numpy(), axis=-1)
        present = np.arange(self.scene.particles) < self.scene.alive.to_numpy()[:, None]
        self.fastest = np.maximum(self.fastest, np.where(present, speed, 0.0).max(axis=1))


@pytest.fixture
def ends(monkeypatch):
    """The `End` of each simulation from here on, by seed."""
    seen = {}

    def noting(run):
        def noted(scene, *given, **options):
            watched, seeds = Watched(scene), given[-1]
            result = run(watched, *given, **options)
            seen.update({int(seed): watched.end(slot) for slot, seed in enumerate(seeds)})
            return result

        return noted

    monkeypatch.setattr(pouring, "_run", noting(pouring._run))
    monkeypatch.setattr(runtime, "CHUNK", LOOK)
    return seen


@pytest.fixture(scope="module")
def violent(glycerin):
    """A setup, and the gripper's path from rest into fast strokes."""
    gripper = glycerin.gripper
    part = (gripper.time >= FIRST) & (gripper.time <= LAST)
    path = SimpleNamespace(time=gripper.time[part] / HASTE, position=gripper.position[part])
    return models.StirSetup.from_recording(glycerin), path


def told(run):
    """The result of `run` and the reasons that it warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", models.FailedSimulation)
        result = run()
    return result, [str(warning.message) for warning in caught]


def stir_faults(drawn, violent):
    """Point -> what was wrong with its stir; 0 for what no single one can be told of."""
    setup, path = violent
    fastest, farthest, heights = 0.0, 0.0, (np.inf, -np.inf)

    def look(scene, step):
        nonlocal fastest, farthest, heights
        held = scene.count.to_numpy()[..., None] > np.arange(scene.particles)
        x, y, z = scene.position.to_numpy()[held].T
        fastest = np.linalg.norm(scene.speed.to_numpy()[held], axis=-1).max(initial=fastest)
        farthest = np.hypot(x, y).max(initial=farthest)
        heights = z.min(initial=heights[0]), z.max(initial=heights[1])

    watch = Watch(1.0 / (LOOK * setup.step(path)), look)
    signal, reasons = told(
        lambda: watched_stir(drawn.liquid, path, setup, drawn.seeds, drawn.effects, watch)
    )
    for k, angles in enumerate(signal):
        if not np.isfinite(angles).all():
            yield k, f"not finite: {reasons}"
        elif np.abs(angles).max() > STEEPEST:
            yield k, f"tilt {np.degrees(np.abs(angles).max()):.0f} deg"
    lowest, highest = heights
    checks = {
        f"{farthest:.4f} m from the axis": farthest <= setup.cup.radius,
        f"height {lowest:.4f} to {highest:.4f} m": 0.0 <= lowest and highest <= setup.cup.height,
        f"{fastest:.2f} m/s": fastest < FASTEST["stir"],
    }
    yield from ((0, what) for what, fine in checks.items() if not fine)


def pour_faults(drawn, cups, ends):
    """Point -> what was wrong with its pour."""
    count = PARTICLES["pour"]
    result, reasons = told(
        lambda: models.pour(
            drawn.liquid, drawn.action, cups, drawn.seeds, count, effects=drawn.effects
        )
    )
    fractions = np.stack([result.spilled, result.received, result.retained], axis=-1)
    for k, shares in enumerate(fractions):
        particles, (_, fastest, astray) = count * shares, ends[int(drawn.seeds[k])]
        checks = {
            f"not finite: {reasons}": np.isfinite(shares).all(),
            f"fractions {shares}": (shares >= 0.0).all() and abs(shares.sum() - 1.0) < 1e-12,
            f"parts of particles {particles}": np.allclose(particles, np.rint(particles)),
            f"{astray} particles past the cup's walls": astray == 0,
            f"{fastest:.2f} m/s": fastest < FASTEST["pour"],
        }
        yield from ((k, what) for what, fine in checks.items() if not fine)


@pytest.mark.minutes
@pytest.mark.parametrize("start", STARTS)
def test_no_point_of_the_prior_box_goes_wrong(start, violent, cups, ends):
    drawn = points(start, cups)
    found = [("stir", *fault) for fault in stir_faults(drawn, violent)]
    found += [("pour", *fault) for fault in pour_faults(drawn, cups, ends)]
    told_apart = [f"{scene}: {what}: {drawn.text(k)}" for scene, k, what in found]
    assert not found, "\n".join(told_apart)


def heaps():
    """A force that puts all particles into one place."""
    import taichi as ti

    @ti.func
    def heap(scene: ti.template(), b, coefficient):
        for i in range(scene.alive[b]):
            scene.position[b, i] = coefficient * scene.position[b, 0]

    return heap


def hurls():
    """A force that makes particles ever faster."""
    import taichi as ti

    @ti.func
    def hurl(scene: ti.template(), b, coefficient):
        for i in range(scene.alive[b]):
            scene.velocity[b, i] = (1.0 + coefficient) * scene.velocity[b, i]

    return hurl


def planted(name, make_force):
    return models.Effect(
        name=name,
        unit="1",
        neutral=0.0,
        acts_in="liquid",
        text="A fault.",
        source="This test",
        make_prior=lambda: None,
        make_force=make_force,
    )


ABSURD = {
    # viscosity [Pa s], cohesion, effects, how it ends
    "solid": (1e30, 0.0, {}, faults.UNSOLVED),
    "glue": (0.1, 1e5, {}, faults.RUNAWAY),
    "rock": (0.1, 0.0, {"yield_stress": 1e30}, faults.UNSOLVED),
    "explosion": (0.1, 0.0, {"hurls": 1.0}, faults.RUNAWAY),
    "implosion": (0.1, 0.0, {"heaps": 1.0}, faults.COLLAPSED),
}
# what compiles scenes of its own is slow; these two take longest
LONG = ("explosion", "rock")
CASES = [
    pytest.param(
        n, marks=pytest.mark.minutes if n in LONG else [pytest.mark.slow] if ABSURD[n][2] else []
    )
    for n in ABSURD
]


def test_every_fault_is_provoked():
    """Also by the cases of continuous integration alone."""
    poured = {ABSURD[n][3] for n in ABSURD if n not in LONG}
    assert poured | {faults.DRIFTED} == set(faults.REASONS)  # which stirs alone have


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_what_goes_wrong_is_nan_with_a_reason(name, cups, register):
    """And the other in its batch keeps its bits."""
    viscosity, cohesion, effects, fault = ABSURD[name]
    register(planted("heaps", heaps))
    register(planted("hurls", hurls))
    seeds, action = np.array([1, 2]), models.PourAction(6.0, 0.03)

    def simulate(part):
        liquid = models.Liquid(
            np.array([0.1, viscosity])[part], np.array([0.0, cohesion])[part], 1000.0
        )
        given = {n: np.array([models.EFFECTS[n].neutral, c])[part] for n, c in effects.items()}
        poured = models.pour(liquid, action, cups, seeds[part], 150, given)
        return np.stack([poured.spilled, poured.received, poured.retained], axis=-1)

    fractions, reasons = told(lambda: simulate(slice(0, 2)))
    assert len(reasons) == 1 and f"seed 2: {faults.REASONS[fault]}" in reasons[0]
    assert np.isnan(fractions[1]).all()
    np.testing.assert_array_equal(fractions[:1], simulate(slice(0, 1)))


def test_a_stir_that_goes_wrong_is_nan_with_a_reason(violent):
    """And the other in its batch keeps its bits."""
    setup, path = violent

    def simulate(viscosity):
        liquid = models.Liquid(np.array(viscosity), 0.2, 1000.0)
        return models.stir(liquid, path, setup, [1, 2][: len(viscosity)])

    angles, reasons = told(lambda: simulate([0.1, 3e38]))
    assert len(reasons) == 1 and f"seed 2: {faults.REASONS[faults.UNSOLVED]}" in reasons[0]
    assert np.isnan(angles[1, 1:]).all()
    np.testing.assert_array_equal(angles[:1], simulate([0.1]))


def test_a_liquid_whose_level_moves_is_a_fault(violent):
    """Steps of 40 ms are too long for it."""
    setup, path = violent
    rough = models.Numerics(longest_step=0.03, courant=1e3)
    setup = replace(setup, numerics=rough, particles=100)
    angles, reasons = told(lambda: models.stir(models.Liquid(0.1, 0.2, 1e3), path, setup, [0]))
    assert reasons and faults.REASONS[faults.DRIFTED] in reasons[0] and np.isnan(angles).any()


@pytest.mark.minutes
def test_a_thread_that_did_not_start_taichi_is_refused_and_does_no_harm(cups):
    def poured():
        liquid = models.Liquid(1.0, 0.2, 1260.0)
        return models.landings(liquid, [2.0], cups, [0], PARTICLES["pour"]).retained

    before = poured()
    with ThreadPoolExecutor(1) as pool:
        with pytest.raises(runtime.WrongThread, match="--nthreads 1"):
            pool.submit(poured).result()
    np.testing.assert_array_equal(poured(), before)


def test_taichi_starts_without_a_word_also_under_a_progress_bar():
    """A progress bar wraps stdout, which Taichi takes for a notebook's."""
    code = """
import io, sys
sys.stdout = io.StringIO()
from bolfi_liquids.models.fluid import fluid, runtime
runtime.start()
assert not sys.stdout.getvalue()
"""
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (made.returncode, made.stdout, made.stderr) == (0, "", "")
