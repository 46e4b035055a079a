"""Series against the diffusion equation integrated by SciPy, and against limits."""

import numpy as np
import pytest
from bolfi_liquids.models.validation.truths import shear_flows
from scipy.integrate import solve_ivp
from scipy.special import erfc

GAP, KINEMATIC = 0.04, 1e-3
DIFFUSION_TIME = GAP**2 / KINEMATIC
NODES = 201


def channel(upper, acceleration, times):
    """Method of lines between walls of velocity 0 and `upper`."""
    z = np.linspace(0.0, GAP, NODES)
    step = z[1] - z[0]

    def rhs(_, u):
        rate = np.zeros_like(u)
        rate[1:-1] = KINEMATIC * (u[2:] - 2 * u[1:-1] + u[:-2]) / step**2 + acceleration
        return rate

    start = np.zeros(NODES)
    start[-1] = upper
    solved = solve_ivp(rhs, (0, times[-1]), start, method="BDF", t_eval=times, rtol=1e-8, atol=1e-9)
    return z, solved.y.T


def test_couette_startup_solves_the_diffusion_equation():
    times = DIFFUSION_TIME * np.array([0.01, 0.05, 0.2, 1.0])
    z, expected = channel(0.3, 0.0, times)
    ours = shear_flows.couette_startup(z, times, gap=GAP, speed=0.3, kinematic=KINEMATIC)
    assert ours.shape == (4, NODES)
    np.testing.assert_allclose(ours, expected, atol=1e-4)
    steady = shear_flows.couette_startup(
        z, 9 * DIFFUSION_TIME, gap=GAP, speed=0.3, kinematic=KINEMATIC
    )
    np.testing.assert_allclose(steady, shear_flows.couette_steady(z, GAP, 0.3), atol=1e-9)


def test_couette_starts_like_stokes_first_problem():
    """Long before the other wall is felt: erfc of the distance over 2 sqrt(ν t)."""
    z = np.linspace(0.5 * GAP, GAP, 50)
    time = 0.003 * DIFFUSION_TIME
    ours = shear_flows.couette_startup(z, time, gap=GAP, speed=1.0, kinematic=KINEMATIC)
    expected = erfc((GAP - z) / (2 * np.sqrt(KINEMATIC * time)))
    np.testing.assert_allclose(ours, expected, atol=1e-6)


def test_poiseuille_startup_solves_the_diffusion_equation():
    times = DIFFUSION_TIME * np.array([0.02, 0.1, 0.5])
    z, expected = channel(0.0, 0.7, times)
    ours = shear_flows.poiseuille_startup(z, times, gap=GAP, acceleration=0.7, kinematic=KINEMATIC)
    np.testing.assert_allclose(ours, expected, atol=2e-4 * expected.max())


def test_poiseuille_begins_in_free_fall_and_ends_as_the_parabola():
    middle = np.array([GAP / 2])
    early = 1e-3 * DIFFUSION_TIME
    arguments = {"gap": GAP, "acceleration": 0.7, "kinematic": KINEMATIC}
    fall = shear_flows.poiseuille_startup(middle, early, **arguments)
    assert fall == pytest.approx(0.7 * early, rel=1e-3)
    z = np.linspace(0.0, GAP, 9)
    steady = shear_flows.poiseuille_steady(z, gap=GAP, gradient=700.0, viscosity=1.0)
    late = shear_flows.poiseuille_startup(z, 9 * DIFFUSION_TIME, **arguments)
    np.testing.assert_allclose(late, steady, atol=1e-9)
    flow = np.trapezoid(
        steady_fine := shear_flows.poiseuille_steady(
            np.linspace(0, GAP, 4001), gap=GAP, gradient=700.0, viscosity=1.0
        ),
        dx=GAP / 4000,
    )
    assert flow == pytest.approx(700.0 * GAP**3 / 12.0, rel=1e-6)
    np.testing.assert_allclose(steady_fine, steady_fine[::-1], atol=1e-12)


def test_a_shear_wave_between_walls_is_the_channels_first_mode():
    """Half a sine between walls at rest, by the method of lines."""
    z = np.linspace(0.0, GAP, NODES)
    step, wave_number = z[1] - z[0], np.pi / GAP

    def rhs(_, u):
        rate = np.zeros_like(u)
        rate[1:-1] = KINEMATIC * (u[2:] - 2 * u[1:-1] + u[:-2]) / step**2
        return rate

    time = 0.2 * DIFFUSION_TIME
    solved = solve_ivp(rhs, (0, time), np.sin(wave_number * z), method="BDF", rtol=1e-8, atol=1e-10)
    ours = shear_flows.shear_wave(1.0, wave_number, KINEMATIC, time)
    assert ours == pytest.approx(solved.y[NODES // 2, -1], rel=1e-3)


def test_spin_up_solves_the_equation_of_a_vortex():
    """u_t = ν (u_rr + u_r/r - u/r²), in flux form: ν (1/r² (r³ (u/r)_r))_r."""
    radius, turn = 0.03, 4.0
    r = np.linspace(0.0, radius, NODES)
    step = r[1] - r[0]
    between = 0.5 * (r[1:] + r[:-1])

    def rhs(_, u):
        spin = np.concatenate([[u[1] / r[1]], u[1:] / r[1:]])
        torque = between**3 * np.diff(spin) / step
        rate = np.zeros_like(u)
        rate[1:-1] = KINEMATIC * np.diff(torque) / step / r[1:-1] ** 2
        return rate

    start = np.zeros(NODES)
    start[-1] = turn * radius
    times = radius**2 / KINEMATIC * np.array([0.01, 0.05, 0.2])
    solved = solve_ivp(rhs, (0, times[-1]), start, method="BDF", t_eval=times, rtol=1e-8, atol=1e-9)
    ours = shear_flows.spin_up(r, times, radius=radius, angular_velocity=turn, kinematic=KINEMATIC)
    np.testing.assert_allclose(ours, solved.y.T, atol=1e-3 * turn * radius)
    late = shear_flows.spin_up(
        r, 2 * radius**2 / KINEMATIC, radius=radius, angular_velocity=turn, kinematic=KINEMATIC
    )
    np.testing.assert_allclose(late, turn * r, atol=1e-9)
