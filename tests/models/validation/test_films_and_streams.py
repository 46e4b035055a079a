"""Films on walls and streams that fall, against what their equations demand."""

import numpy as np
import pytest
from bolfi_liquids.models.validation.truths import falling_stream, films
from scipy.integrate import quad, solve_ivp

GLYCERIN = {"viscosity": 1.4, "density": 1260.0}
THICKNESS = 2e-3


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
    assert films.nusselt_thickness(flux, **GLYCERIN) == pytest.approx(THICKNESS)
    surface = films.nusselt_velocity(THICKNESS, THICKNESS, **GLYCERIN)
    assert flux / THICKNESS == pytest.approx(2.0 / 3.0 * surface)


def test_a_film_starts_as_fast_as_diffusion_lets_it():
    """Finite differences across a film from rest: what is missing dies away by exp(-t / T)."""
    kinematic, count = 1.4 / 1260.0, 100
    width = THICKNESS / count
    steady = films.nusselt_velocity((np.arange(count) + 0.5) * width, THICKNESS, **GLYCERIN)

    def along(_, u):
        below = np.concatenate([[-u[0]], u[:-1]])  # the wall is half a cell below the first
        above = np.concatenate([u[1:], [u[-1]]])
        return 9.81 + kinematic * (below - 2.0 * u + above) / width**2

    time = films.film_startup_time(THICKNESS, **GLYCERIN)
    at = time * np.array([1.5, 3.0])
    solved = solve_ivp(along, (0, at[1]), np.zeros(count), t_eval=at, method="BDF", rtol=1e-8)
    missing = (steady[:, None] - solved.y).mean(axis=0)
    assert missing[1] / missing[0] == pytest.approx(np.exp(-1.5), rel=0.01)


def test_a_stream_falls_as_a_stone_and_keeps_its_volume():
    drop = np.array([0.0, 0.05, 0.2])
    time = np.linspace(0.0, 0.3, 4001)
    fallen = 0.3 * time + 0.5 * 9.81 * time**2
    speed = 0.3 + 9.81 * np.interp(drop, fallen, time)
    np.testing.assert_allclose(falling_stream.fall_speed(0.3, drop), speed, rtol=1e-5)
    area = falling_stream.stream_area(1e-4, 0.3, drop)
    np.testing.assert_allclose(area * speed, 3e-5, rtol=1e-5)


def test_a_stream_gains_the_momentum_of_its_weight():
    def area(drop):
        return falling_stream.stream_area(1e-4, 0.3, drop)

    weight, _ = quad(lambda drop: 1000.0 * 9.81 * area(drop), 0.0, 0.13)
    first, last = falling_stream.momentum_flux(3e-5, 0.3, np.array([0.0, 0.13]), 1000.0)
    assert last - first == pytest.approx(weight)
    assert first == pytest.approx(1000.0 * 1e-4 * 0.3**2)


@pytest.mark.parametrize("up", [-0.4, 0.0, 0.3])
def test_liquid_lands_where_its_parabola_meets_the_plane(up):
    place, time = falling_stream.landing(np.array([0.25, up]), 0.13)
    assert place == pytest.approx(0.25 * time) and time > 0.0
    assert up * time - 0.5 * 9.81 * time**2 == pytest.approx(-0.13)
