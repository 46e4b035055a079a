"""Force of a viscous liquid on an upright stick that is moved to and fro on the axis of a cup."""

from typing import NamedTuple

import numpy as np
from case import Case, CaseResult, Curve, Panel, Row
from scenes.held_stick import slip_forces
from scenes.still_cup import DENSITY, StillCup
from truths.oscillating_rod import stokes_reaction_in_cup

RADIUS = 0.0045  # m
CUP = StillCup(depth=0.06, slippery_floor=True)
VISCOSITY = np.array([0.1, 0.3, 1.0, 3.0, 10.0])  # Pa s
PERIODS, FITTED = 4, 2


class Motion(NamedTuple):
    """Frequency [Hz] and amplitude [m], and what holds of the force at each viscosity.

    Attributes:
        amplitude_error: Largest relative error of the force's amplitude.
        phase_error: Of its phase [quarter periods].
    """

    frequency: float
    amplitude: float
    amplitude_error: tuple[float, ...]
    phase_error: tuple[float, ...]


MOTIONS = (
    Motion(0.7, 0.004, (0.12, 0.08, 0.05, 0.07, 0.27), (0.1, 0.1, 0.1, 0.2, 0.4)),
    Motion(2.0, 0.002, (0.12, 0.1, 0.15, 0.25, 0.6), (0.3, 0.3, 0.3, 0.4, 0.7)),
)


def reactions(motion: Motion, seed: int) -> np.ndarray:
    """Force over that which accelerates the displaced liquid, complex as in
    `stokes_reaction_in_cup`: added mass - i damping; shape [B]."""
    omega = 2.0 * np.pi * motion.frequency

    def path(time: np.ndarray) -> np.ndarray:
        return np.tile(motion.amplitude * np.sin(omega * time), (len(VISCOSITY), 1))

    slip = slip_forces(CUP, RADIUS, VISCOSITY, path, PERIODS / motion.frequency, seed)
    late = slip.time > (PERIODS - FITTED) / motion.frequency
    turn = omega * slip.time[late]
    displaced = DENSITY * np.pi * RADIUS**2 * motion.amplitude * omega**2
    basis = displaced * np.stack([-np.sin(turn), np.cos(turn)], axis=1)
    (mass, damping), *_ = np.linalg.lstsq(basis, slip.force[late], rcond=None)
    # the impulse is that of twice the displaced mass, once of which moves with the stick
    return 1.0 + mass - 1j * damping


def run(seed: int) -> CaseResult:
    """Amplitude and phase of the force at each frequency and viscosity."""
    rows, panels = [], []
    for motion in MOTIONS:
        omega = 2.0 * np.pi * motion.frequency
        exact = [
            stokes_reaction_in_cup(RADIUS, CUP.radius, omega, mu / DENSITY) for mu in VISCOSITY
        ]
        truth = np.array([one.added_mass - 1j * one.damping for one in exact])
        ours = reactions(motion, seed)
        lead = (np.angle(ours) - np.angle(truth)) / (0.5 * np.pi)
        for k, mu in enumerate(VISCOSITY):
            name = f"{mu:g} Pa s, {motion.frequency:g} Hz"
            rows += [
                Row.relative(
                    f"relative force at {name}, over the displaced mass's",
                    abs(truth[k]),
                    abs(ours[k]),
                    motion.amplitude_error[k],
                ),
                Row.absolute(
                    f"phase at {name} [quarter periods]", 0.0, lead[k], motion.phase_error[k]
                ),
            ]
        curves = (
            Curve("exact", VISCOSITY, np.abs(truth), truth=True),
            Curve("simulated", VISCOSITY, np.abs(ours)),
        )
        label = f"force over that of the displaced mass, {motion.frequency:g} Hz"
        panels.append(Panel("viscosity [Pa s]", label, curves, log="xy"))
    notes = {
        "tolerance": "as measured. From 3 Pa s on the force lags by several steps, the more the "
        "thicker: nodes carry it from step to step and change it by what they alone would move. "
        "Quarter steps of time leave 8 degrees at 10 Pa s, 1 Hz"
    }
    return CaseResult(tuple(rows), tuple(panels), notes)


CASE = Case(
    truth="added mass and drag of a cylinder that oscillates within another",
    source="Stokes 1851; Chen, Wambsganss & Jendrzejczyk 1976 for the outer cylinder",
    unit="",
    run=run,
)
