import numpy as np
import pytest
from bolfi_liquids.hardware.emulator.hanging_stick import (
    GRAVITY,
    HangingStick,
    Pivot,
    Stick,
    Swing,
    step,
)
from scipy.integrate import quad
from scipy.optimize import brentq

AIR = Stick(
    radius=0.004,
    length=0.25,
    mass=0.03,
    liquid_density=1000.0,
    viscosity=1e-3,
    fill=0.1,
    cup_position=(0.0, 0.0, 0.0),
)
HIGH = Pivot(0.0, 0.0, 0.0, 0.0, height=1.0)
LOW = HIGH._replace(height=0.27)  # tip 0.02 above the floor, 0.08 of the stick wet
GLYCERIN = AIR._replace(liquid_density=1260.0, viscosity=1.0)
DT = 1e-3


def swung(stick, swing, pivot, seconds):
    angles = []
    for _ in range(round(seconds / DT)):
        swing = step(stick, swing, pivot, DT)
        angles.append(swing.angle)
    return np.array(angles), swing


def test_period_in_air_is_that_of_a_rod():
    angles, _ = swung(AIR, Swing(0.01, 0.0), HIGH, 10.0)
    falls = np.flatnonzero((angles[:-1] > 0) & (angles[1:] <= 0))
    period = np.diff(falls).mean() * DT
    assert period == pytest.approx(2 * np.pi * np.sqrt(2 * AIR.length / (3 * GRAVITY)), rel=2e-3)


def test_buoyancy_and_added_mass_slow_it_down():
    thin = AIR._replace(drag=0.0)
    angles, _ = swung(thin, Swing(0.01, 0.0), LOW, 10.0)
    falls = np.flatnonzero((angles[:-1] > 0) & (angles[1:] <= 0))
    dry, length = LOW.height - AIR.fill, AIR.length
    line = AIR.liquid_density * np.pi * AIR.radius**2
    wet = quad(lambda s: s, dry, length)[0]
    inertia = AIR.mass * length**2 / 3 + line * quad(lambda s: s * s, dry, length)[0]
    stiffness = GRAVITY * (AIR.mass * length / 2 - line * wet)
    assert np.diff(falls).mean() * DT == pytest.approx(
        2 * np.pi * np.sqrt(inertia / stiffness), rel=2e-3
    )


def energy(stick, swing):
    kinetic = stick.mass * stick.length**2 / 6 * swing.rate**2
    return kinetic + stick.mass * GRAVITY * stick.length / 2 * (1 - np.cos(swing.angle))


def test_energy_in_air_falls_as_the_damping_says():
    start = Swing(0.1, 0.0)
    _, end = swung(AIR, start, HIGH, 10.0)
    # the rate is damped by exp(-c t / 2), its square by exp(-c t), with c = 0.05 / s
    assert energy(AIR, end) / energy(AIR, start) == pytest.approx(np.exp(-0.5), rel=0.02)


@pytest.mark.parametrize("viscosity", [1e-3, 1.0, 1000.0])
def test_liquid_takes_energy_and_never_gives_any(viscosity):
    stick, swing = GLYCERIN._replace(viscosity=viscosity), Swing(0.3, 0.0)
    angles, _ = swung(stick, swing, LOW, 2.0)
    assert np.abs(angles).max() <= 0.3
    peaks = np.abs(angles[1:-1])[np.diff(np.sign(np.diff(angles))) != 0]
    assert (np.diff(peaks) < 1e-9).all()


def towed_angle(stick, speed, height):
    """Where the moments of weight, buoyancy and drag of a towed cylinder cancel."""
    diameter = 2 * stick.radius
    line = stick.liquid_density * np.pi * stick.radius**2

    def moment(angle):
        dry = (height - stick.fill) / np.cos(angle)
        across = speed * np.cos(angle)
        reynolds = stick.liquid_density * across * diameter / stick.viscosity
        coefficient = 1 + 10 * reynolds ** (-2 / 3)
        drag = 0.5 * stick.liquid_density * coefficient * diameter * across**2
        wet = (stick.length**2 - dry**2) / 2
        weight = GRAVITY * np.sin(angle) * (stick.mass * stick.length / 2 - line * wet)
        return -weight - drag * wet

    return brentq(moment, -1.2, 0.0)


@pytest.mark.parametrize("stick", [AIR, GLYCERIN], ids=["water", "glycerin"])
def test_towed_stick_trails_where_the_moments_cancel(stick):
    pivot = LOW._replace(speed=0.1)
    _, end = swung(stick, Swing(0.0, 0.0), pivot, 30.0)
    assert end.angle == pytest.approx(towed_angle(stick, 0.1, LOW.height), rel=5e-3)


def test_the_two_planes_are_the_base_s():
    hanging = HangingStick(AIR, [0, 0, 1.0, 0, 0, 0])
    for k in range(1, 11):
        hanging.advance([0, 0, 1.0, 0, 0, 0], [0.01 * k, -0.02 * k, 0, 0, 0, 0], 0.008)
    # the tip lags: to -x where the pivot accelerates to +x; a rod's first rate is 3/2 a/L
    xz, yz = hanging.angles
    assert xz < 0 < yz
    assert yz == pytest.approx(-2 * xz, rel=1e-2)
    acceleration, time = 0.01 / 0.008, 0.08
    assert xz == pytest.approx(-0.75 * acceleration / AIR.length * time**2, rel=0.06)


def test_coarse_and_fine_ticks_agree():
    ends = []
    for dt in (0.008, 0.002):
        hanging = HangingStick(GLYCERIN, [0, 0, 0.27, 0, 0, 0])
        for k in range(1, round(1.0 / dt) + 1):
            speed = 0.1 * np.sin(2 * np.pi * k * dt)
            hanging.advance([0, 0, 0.27, 0, 0, 0], [speed, 0, 0, 0, 0, 0], dt)
        ends.append(hanging.angles[0])
    assert ends[0] == pytest.approx(ends[1], abs=2e-3)
