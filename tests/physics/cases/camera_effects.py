"""What effects in the cameras do to a stir, against what such cameras see of the stick."""

from dataclasses import replace

import numpy as np
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import StirSetup
from bolfi_liquids.models.stirring import stir
from case import Case, CaseResult, Curve, Panel, Row

from . import _stirring, seed_noise

LIQUID = Liquid(0.1, 0.0, 1000.0)
DELAY, TURN, ROLL = 0.08, np.radians(5.0), np.radians(1.0)  # s, rad, rad
RATE = 240.0  # Hz of the path, so that what a camera misses between two frames is nothing
SECONDS = 4.0
TOLERANCE = 0.02  # deg


def path() -> _stirring.Path:
    """A slow circle that begins gently, about the cup's axis."""
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    radius = 0.015 * np.minimum(time, 1.0) ** 2
    angle = 2.0 * np.pi * 0.8 * time
    height = seed_noise.STICK.length - seed_noise.SUBMERGED + seed_noise.CUP.fill
    around = [radius * np.sin(angle), radius * np.sin(2.0 * angle), np.full_like(time, height)]
    return _stirring.Path(time, np.column_stack(around))


def late(time: np.ndarray, signal: np.ndarray) -> np.ndarray:
    """What cameras show whose clock is `DELAY` behind."""
    return np.column_stack([np.interp(time - DELAY, time, plane) for plane in signal.T])


def turned(signal: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Inclinations [T, 2] that a frame sees which is turned by a matrix."""
    direction = np.column_stack([np.tan(signal), -np.ones(len(signal))]) @ rotation
    return np.arctan2(direction[:, :2], -direction[:, 2:])


def run(seed: int) -> CaseResult:
    """One effect after the other, and the same stir without it."""
    setup = StirSetup(seed_noise.CUP, seed_noise.STICK, seed_noise.SUBMERGED)
    stirred = path()
    c, s = np.cos(TURN), np.sin(TURN)
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    c, s = np.cos(ROLL), np.sin(ROLL)
    about_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    sizes = {"camera_delay": DELAY, "camera_rotation": TURN, "camera_tilt": ROLL}
    plain = stir(LIQUID, stirred, setup, [seed])[0]
    # a rolled frame sees upright what leans
    leaning = replace(setup, tilt=(-ROLL, 0.0))
    rolled = stir(LIQUID, stirred, leaning, [seed])[0]
    expected = {
        "camera_delay": late(stirred.time, plain),
        "camera_rotation": turned(plain, about_z),
        "camera_tilt": turned(rolled, about_y),
    }
    rows, curves = [], []
    for number, (name, size) in enumerate(sizes.items()):
        ours = stir(LIQUID, stirred, setup, [seed], {name: size})[0]
        off = np.degrees(ours - expected[name])
        rms = float(np.sqrt(np.mean(off**2)))
        rows.append(Row.absolute(f"RMS difference, {name} {size:.3g} [deg]", 0.0, rms, TOLERANCE))
        truth = np.degrees(expected[name][:, 0])
        curves += [
            Curve(name, stirred.time, truth, truth=True, series=number),
            Curve("", stirred.time, np.degrees(ours[:, 0]), series=number),
        ]
    return CaseResult(tuple(rows), (Panel("time [s]", "inclination, xz [deg]", tuple(curves)),))


CASE = Case(
    truth="the same stir, seen late or in a frame that is turned",
    source="rotation of the stick's direction",
    unit="deg",
    run=run,
)
