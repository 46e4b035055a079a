"""Films on walls and streams that fall, against what their equations demand."""

import numpy as np
import pytest
from scipy.integrate import quad
from truths import falling_stream, films

GLYCERIN = {"viscosity": 1.4, "density": 1260.0}
THICKNESS = 2e-3
ANGLES = np.radians([10.0, 60.0, 110.0, 130.0])


def test_jeffreys_film_conserves_mass():
    """h_t + (ρ g h³ / 3 μ)_z = 0 with the flux of a film in free fall."""
    liquid = {"viscosity": 1.4, "density": 1260.0}

    def film(z, t):
        return films.jeffreys_thickness(z, t, **liquid)

    def flux(z, t):
        return films.nusselt_flux(film(z, t), **liquid)

    z, t, step = 0.07, 3.0, 1e-4
    thinning = (film(z, t + step) - film(z, t - step)) / (2 * step)
    outflow = (flux(z + step, t) - flux(z - step, t)) / (2 * step)
    assert thinning == pytest.approx(-outflow, rel=1e-5)
    held, _ = quad(lambda z: 0.2 * film(z, t), 0, 0.1)
    assert films.jeffreys_volume(0.2, 0.1, t, **liquid) == pytest.approx(held, rel=1e-6)
    # 1.5 mm of glycerol, 0.1 m down after 5 s
    assert film(0.1, 5.0) == pytest.approx(1.5e-3, rel=0.05)


def test_a_steady_film_bears_its_weight_by_its_shear():
    """μ u'' = -ρ g, at rest on the wall, without shear at the surface."""
    y, step = np.linspace(2e-4, 1.8e-3, 9), 1e-5

    def speed(at):
        return films.nusselt_velocity(at, THICKNESS, **GLYCERIN)

    bent = (speed(y + step) - 2.0 * speed(y) + speed(y - step)) / step**2
    np.testing.assert_allclose(1.4 * bent, -1260.0 * 9.81, rtol=1e-5)
    assert speed(0.0) == 0.0
    slope = (speed(THICKNESS) - speed(THICKNESS - step)) / step
    assert abs(slope) < 1e-2 * speed(THICKNESS) / THICKNESS


def test_a_films_flux_is_the_integral_of_its_speed():
    carried, _ = quad(lambda y: films.nusselt_velocity(y, THICKNESS, **GLYCERIN), 0.0, THICKNESS)
    flux = films.nusselt_flux(THICKNESS, **GLYCERIN)
    assert flux == pytest.approx(carried)
    surface = films.nusselt_velocity(THICKNESS, THICKNESS, **GLYCERIN)
    assert flux / THICKNESS == pytest.approx(2.0 / 3.0 * surface)


def test_an_edge_draws_back_as_wedges_of_its_angle_flow():
    """Cox 1986 (J. Fluid Mech. 168, 169), equation 8.3, beside a liquid of no viscosity."""
    speed = films.dewetting_speed(ANGLES, tension=0.063, viscosity=1.0, slip=1.0)
    for angle, found in zip(ANGLES, speed, strict=True):
        bent, _ = quad(lambda x: (x - np.sin(x) * np.cos(x)) / (2.0 * np.sin(x)), 0.0, angle)
        assert found == pytest.approx(0.063 * bent, rel=0.05)


def test_a_stream_falls_as_a_stone():
    drop = np.array([0.0, 0.05, 0.2])
    time = np.linspace(0.0, 0.3, 4001)
    fallen = 0.3 * time + 0.5 * 9.81 * time**2
    speed = 0.3 + 9.81 * np.interp(drop, fallen, time)
    np.testing.assert_allclose(falling_stream.fall_speed(0.3, drop), speed, rtol=1e-5)
