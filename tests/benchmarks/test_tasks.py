"""Are the tasks' exact posteriors exact? Against closed forms, brute force and identities."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import toeplitz
from scipy.special import ndtr, ndtri
from scipy.stats import binom, chi2, multivariate_normal, norm
from tasks import TASKS, make_reference, score
from tasks.epidemics import DAYS, IN_BED, quantiles
from tasks.gauss import COVARIANCE, SIZE
from tasks.ma import from_square, to_square
from tasks.pendulum import NOISE, STEP
from tasks.reference import mean_and_sd
from tasks.shapes import COMPLEX, MIXTURE, corner

LOG_MEDIANS = np.array([-0.125, -3.0, -0.125, -3.0])
ALPHA = 1e-4  # false alarms per test
TRUTH = {
    "gauss2": (0.7, -0.4),
    "ma2": tuple(float(u) for u in to_square(0.6, 0.2)),
    "pend2": (0.25, 0.15),
    "pendobs": (0.25, 0.15),
    "pendobs3": (0.25, 0.15, 20.0),
    "gaussian_mixture": tuple(MIXTURE.values()),
    "sir": tuple(u[0] for u in quantiles().values()),
    "lotka_volterra": tuple(ndtr((np.log([0.69, 0.08, 0.89, 0.08]) - LOG_MEDIANS) / 0.5)),
    "slcp": tuple(COMPLEX.values()),
}
DETERMINISTIC = ("lotka_volterra", "ball_drop", "boarding_school")


@pytest.fixture(params=list(TASKS))
def task(request):
    return TASKS[request.param]


def prior_draws(task, n, seed=0):
    low, high = task.bounds.T
    return np.random.default_rng(seed).uniform(low, high, (n, len(low)))


def test_rows_do_not_depend_on_their_batch(task):
    points, seeds = prior_draws(task, 5), np.arange(5) + 3
    together = task.simulate(task.theta(points), seeds)
    alone = [task.simulate(task.theta(points[i : i + 1]), seeds[i : i + 1])[0] for i in range(5)]
    np.testing.assert_allclose(together, alone, rtol=1e-9, atol=1e-12)
    others = task.simulate(task.theta(points), seeds + 1)
    assert np.array_equal(together, others) == (task.name in DETERMINISTIC)


def test_discrepancies_and_views_fit_the_data(task):
    observed = task.observe(0)
    signals = task.simulate(task.theta(prior_draws(task, 3)), np.arange(3))
    assert all(task.discrepancy(observed, signal) > 0.0 for signal in signals)
    view = task.view(signals)
    assert task.view(observed[None]).shape[1:] == view.shape[1:]
    assert task.noise is None or task.noise.shape == (view.shape[1],) * 2


@pytest.mark.slow
@pytest.mark.parametrize("task", [TASKS[name] for name in TRUTH], ids=list(TRUTH))
def test_scores_of_the_likelihood_average_to_zero_and_vary_by_the_information(task):
    """At the truth, over data sets: E s = 0 and E s s' = -E H (first and second Bartlett identity).

    Data drawn otherwise than the likelihood says break them: 100 data sets show a mean off by
    half an sd, or a variance off by a factor of 1.8. Real data have no truth, and two_moons has a
    density that does not vanish where it ends.
    """
    runs, d = 100, len(task.names)
    truth, steps = np.array(TRUTH[task.name]), 1e-4 * np.ptp(task.bounds, axis=1)
    offsets = np.array(np.meshgrid(*[[-1, 0, 1]] * d, indexing="ij")).reshape(d, -1).T
    theta = task.theta(truth + offsets * steps)
    grids = [task.log_likelihood(task.observe(seed), theta) for seed in range(runs)]
    value = np.stack(grids).reshape(runs, *[3] * d)

    def at(*moves):
        index = [1] * d
        for axis, move in moves:
            index[axis] += move
        return value[(slice(None), *index)]

    slope = np.stack([(at((j, 1)) - at((j, -1))) / 2 for j in range(d)], -1)
    hessian = np.empty((d, d))
    for i in range(d):
        for j in range(d):
            moved = [at((i, a), (j, b)) * a * b for a in (1, -1) for b in (1, -1)] if i != j else []
            second = sum(moved) / 4 if i != j else at((i, 1)) - 2 * at() + at((i, -1))
            hessian[i, j] = second.mean()
    white = np.linalg.solve(np.linalg.cholesky(-hessian), slope.T)  # [d, runs]
    z = white.mean(axis=1) * np.sqrt(runs)
    assert (np.abs(z) < norm.ppf(1 - ALPHA / (2 * d))).all(), z
    squares = (white**2).sum(axis=1)
    low, high = chi2.ppf([ALPHA / (2 * d), 1 - ALPHA / (2 * d)], runs)
    assert ((low < squares) & (squares < high)).all(), squares / runs


def test_gauss2_has_the_closed_form():
    task = TASKS["gauss2"]
    observed = task.observe(0)
    reference = make_reference(task, observed)
    exact = multivariate_normal(observed.mean(axis=0), COVARIANCE / SIZE).pdf(reference.points)
    np.testing.assert_allclose(
        reference.mass, exact * reference.volume * 64.0, rtol=1e-3, atol=1e-9
    )


def test_ma2_agrees_with_the_dense_normal_density():
    task = TASKS["ma2"]
    observed, points = task.observe(0), prior_draws(task, 20)
    t1, t2 = from_square(*points.T)
    assert ((np.abs(t1) < 1 + t2) & (t2 < 1)).all()
    np.testing.assert_allclose(np.stack(to_square(t1, t2), -1), points, rtol=1e-12)
    dense = []
    for a, b in zip(t1, t2, strict=True):
        column = np.zeros(len(observed))
        column[:3] = 1 + a**2 + b**2, a + a * b, b
        dense.append(multivariate_normal(cov=toeplitz(column)).logpdf(observed))
    banded = task.log_likelihood(observed, task.theta(points))
    np.testing.assert_allclose(banded - banded[0], np.array(dense) - dense[0], rtol=1e-9)


def test_the_triangle_is_filled_evenly():
    t1, t2 = from_square(*prior_draws(TASKS["ma2"], 40_000).T)
    left = np.mean(t1 < 0)
    low = np.mean(t2 < 0)  # a quarter of the triangle
    assert abs(left - 0.5) < norm.ppf(1 - ALPHA / 2) * np.sqrt(0.25 / 40_000)
    assert abs(low - 0.25) < norm.ppf(1 - ALPHA / 2) * np.sqrt(0.1875 / 40_000)


def test_pend2_agrees_with_steps_taken_one_by_one():
    task = TASKS["pend2"]
    observed, points = task.observe(0), prior_draws(task, 10)
    brute = np.zeros(10)
    for n, (c1, c2) in enumerate(points):
        angle, rate = 1.2, 0.0
        for i, (next_angle, next_rate) in enumerate(observed[0]):
            drift = -20 * np.sin(angle) - c1 * rate - c2 * abs(rate) * rate
            mean = rate + STEP * (drift + 3 * np.cos(3 * i * STEP))
            brute[n] += norm.logpdf(next_rate, mean, NOISE * np.sqrt(STEP))
            angle, rate = next_angle, next_rate
    quick = task.log_likelihood(observed, task.theta(points))
    np.testing.assert_allclose(quick - quick[0], brute - brute[0], rtol=1e-8)


def test_finer_grids_change_nothing():
    """pendobs has the narrowest ridge, of correlation -0.97."""
    task = TASKS["pendobs"]
    observed = task.observe(0)
    coarse, fine = (make_reference(task, observed, cells) for cells in (70, 140))
    np.testing.assert_allclose(
        mean_and_sd(coarse.points, coarse.mass), mean_and_sd(fine.points, fine.mass), rtol=1e-3
    )
    other = [task.log_likelihood(task.observe(1), task.theta(g.points)) for g in (coarse, fine)]
    scores = [score(o, g) for o, g in zip(other, (coarse, fine), strict=True)]
    np.testing.assert_allclose(*scores, atol=2e-3)


def test_three_parameters_are_found_in_a_small_part_of_the_box():
    task = TASKS["pendobs3"]
    reference = make_reference(task, task.observe(0), cells=24)
    mean, sd = mean_and_sd(reference.points, reference.mass)
    assert (sd[2] < 0.02 * 8.0) and (np.abs(mean - TRUTH["pendobs3"]) < 4 * sd).all()
    assert reference.volume.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("shift", [0.0, 0.1, 0.5, 20.0])
def test_score_of_a_shifted_normal(shift):
    """TV of N(0, S) and N(m, S) is 2 Phi(|m| / 2) - 1 with |m| in units of S."""
    task = TASKS["gauss2"]
    observed = task.observe(0)
    reference = make_reference(task, observed)
    moved = observed + [shift, 0.0] if shift < 4.0 else -observed
    found = score(task.log_likelihood(moved, task.theta(reference.points)), reference)
    difference = (moved - observed).mean(axis=0)
    distance = np.sqrt(difference @ np.linalg.inv(COVARIANCE / SIZE) @ difference)
    assert found.total_variation == pytest.approx(2 * norm.cdf(distance / 2) - 1, abs=2e-3)
    sds = difference * np.sqrt(SIZE)
    assert found.mean_error == pytest.approx(np.sqrt(np.mean(sds**2)), rel=0.01, abs=1e-3)
    assert found.sd_ratio == pytest.approx(1.0, abs=0.03)
    held = norm.cdf(sds + norm.ppf(0.95)) - norm.cdf(sds + norm.ppf(0.05))
    assert found.coverage == pytest.approx(held.mean(), abs=0.01)


def test_score_of_a_wider_normal():
    """Twice the sd in two dimensions: TV = 1/4^(1/3) - 1/4^(4/3), where the densities cross."""
    task = TASKS["gauss2"]
    reference = make_reference(task, task.observe(0))
    log_density = task.log_likelihood(task.observe(0), task.theta(reference.points)) / 4.0
    found = score(log_density, reference)
    assert found.total_variation == pytest.approx(4 ** (-1 / 3) - 4 ** (-4 / 3), abs=2e-3)
    assert found.sd_ratio == pytest.approx(2.0, abs=0.01)
    assert found.mean_error < 5e-3
    assert found.coverage == pytest.approx(2 * norm.cdf(2 * norm.ppf(0.95)) - 1, abs=2e-3)


def test_densities_that_mean_nothing_are_refused():
    task = TASKS["gauss2"]
    reference = make_reference(task, task.observe(0), cells=20)
    for value in (np.nan, -np.inf, np.inf):
        with pytest.raises(ValueError, match="log densities"):
            score(np.full(400, value), reference)


def in_units(task, points):
    """Of sir's quantiles, beta and gamma."""
    if task.name != "sir":
        return points
    return np.exp(np.log([0.4, 0.125]) + [0.5, 0.2] * ndtri(points))


# observation 1, and mean and sd of 2000 draws of the benchmark's reference posterior (sbibm, MIT);
# for ball_drop of 2000 draws of a grid
PUBLISHED = {
    "two_moons": ((-0.6396706, 0.16234657), (-0.1191, 0.1104), (0.6768, 0.6751)),
    "gaussian_mixture": ((-9.472713, -1.4950509), (-9.2679, -1.511), (0.5067, 0.6575)),
    "sir": (
        (0.0, 1.0, 352.0, 40.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.6327, 0.169),
        (0.0127, 0.0124),
    ),
    "ball_drop": ((2.1502001, 3.1681314, 3.9311893), (0.5365, 9.7469), (0.2337, 0.8622)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_references_agree_with_published_draws(name):
    """Within their Monte Carlo error; kurtoses up to 5 are allowed for."""
    task, (observed, mean, sd) = TASKS[name], PUBLISHED[name]
    reference = make_reference(task, np.array(observed))
    found_mean, found_sd = mean_and_sd(in_units(task, reference.points), reference.mass)
    z = norm.ppf(1 - ALPHA / 8)
    assert (np.abs(found_mean - mean) < z * np.array(sd) / np.sqrt(2000)).all()
    assert (np.abs(found_sd / sd - 1.0) < z * np.sqrt(4.0 / 4 / 2000)).all()


@pytest.mark.slow
def test_scattered_points_agree_with_grids():
    """Of the exact posterior, and in the score of another: of other data, and far wider."""
    for name in ("gauss2", "pendobs", "ball_drop"):
        task, observed = TASKS[name], TASKS[name].observe(0)
        grid = make_reference(task, observed)
        scattered = make_reference(replace(task, gridded=False), observed)
        (mean, sd), (other, _) = (mean_and_sd(r.points, r.mass) for r in (grid, scattered))
        assert (np.abs(other - mean) < 0.1 * sd).all()
        for shift, power in ((0.05, 1.0), (0.0, 0.1)):
            found = [
                score(power * task.log_likelihood(observed + shift, task.theta(r.points)), r)
                for r in (grid, scattered)
            ]
            np.testing.assert_allclose(*found, atol=0.05, rtol=0.05)


@pytest.mark.slow
def test_all_four_modes_of_slcp_have_their_share():
    """t3 and t4 enter by their squares."""
    reference = make_reference(TASKS["slcp"], TASKS["slcp"].observe(0))
    for j in (2, 3):
        share = reference.mass[reference.points[:, j] > 0.0].sum()
        assert abs(share - 0.5) < norm.ppf(1 - ALPHA / 4) * 0.5 / np.sqrt(1000)


def test_equations_are_those_that_a_library_solves():
    def solved(rate, start, times):
        return solve_ivp(rate, (0.0, times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-12).y

    def sir(beta, gamma, n):
        return lambda _, y: [-beta * y[0] * y[1] / n, beta * y[0] * y[1] / n - gamma * y[1]]

    task, u = TASKS["sir"], quantiles()
    infectious = solved(sir(0.61479264, 0.19172086, 1e6), [1e6 - 1, 1.0], DAYS)[1] / 1e6
    counts = np.array([0, 1, 352, 40, 3, 0, 0, 0, 0, 0])
    other = {"u_beta": np.array([0.6]), "u_gamma": np.array([0.7])}
    beta, gamma = (float(v) for v in in_units(task, np.array([0.6, 0.7])))
    elsewhere = solved(sir(beta, gamma, 1e6), [1e6 - 1, 1.0], DAYS)[1] / 1e6
    exact = [binom.logpmf(counts, 1000, p).sum() for p in (infectious, elsewhere)]
    ours = [task.log_likelihood(counts, theta)[0] for theta in (u, other)]
    assert np.diff(ours) == pytest.approx(np.diff(exact), rel=1e-5)

    boys = TASKS["boarding_school"].simulate({"beta": np.array([1.7]), "gamma": np.array([0.4])}, 0)
    days = np.arange(0.0, len(IN_BED) + 1.0)
    np.testing.assert_allclose(boys[0], solved(sir(1.7, 0.4, 763), [762.0, 1.0], days)[1, 1:], 1e-4)

    def hares(_, y):
        return [0.69 * y[0] - 0.08 * y[0] * y[1], 0.08 * y[0] * y[1] - 0.89 * y[1]]

    task = TASKS["lotka_volterra"]
    seen = task.simulate(task.theta(np.array([TRUTH["lotka_volterra"]])), np.zeros(1))[0]
    exact = np.log(solved(hares, [30.0, 1.0], 2.1 * np.arange(10))).T.ravel()
    np.testing.assert_allclose(np.sort(seen), np.sort(exact), atol=1e-3)


def test_densities_of_mixture_and_slcp_agree_with_a_library():
    for name in ("gaussian_mixture", "slcp"):
        task = TASKS[name]
        observed, points = task.observe(0), prior_draws(task, 8)
        exact = []
        for t in points:
            if name == "slcp":
                a, b, c = t[2] ** 2, t[3] ** 2, np.tanh(t[4])
                matrix = np.array([[a * a, c * a * b], [c * a * b, b * b]]) + 1e-6 * np.eye(2)
                exact.append(multivariate_normal(t[:2], matrix).logpdf(observed).sum())
            else:
                halves = [multivariate_normal(t, sd**2).pdf(observed) for sd in (1.0, 0.1)]
                exact.append(np.log(np.mean(halves)))
        ours = task.log_likelihood(observed, task.theta(points))
        finite = np.isfinite(exact)
        assert finite.sum() > 1
        np.testing.assert_allclose(np.ptp((ours - exact)[finite]), 0.0, atol=1e-6)


def test_moons_are_simulated_from_their_density():
    """Its integral is 1, and that over a half of a moon the share of points in it."""
    task, n, cells = TASKS["two_moons"], 20_000, 801
    theta = {"t1": np.array([0.3]), "t2": np.array([-0.5])}
    axes = np.linspace(0.0, 0.2, cells), np.linspace(-0.2, 0.2, cells)
    offsets = np.stack([a.ravel() for a in np.meshgrid(*axes)], axis=-1)
    with np.errstate(divide="ignore"):  # the middle itself
        density = np.exp(task.log_likelihood(corner(theta) + offsets, theta))
    mass = np.where(np.isfinite(density), density, 0.0) * np.prod([a[1] - a[0] for a in axes])
    mass /= np.pi * np.sqrt(2.0 * np.pi) * 0.01
    many = {name: np.repeat(value, n) for name, value in theta.items()}
    seen = task.simulate(many, np.arange(n)) - corner(theta)
    assert mass.sum() == pytest.approx(1.0, abs=0.01)
    for half in (lambda x: x[:, 1] > 0.05, lambda x: np.hypot(*x.T) > 0.105):
        share = mass[half(offsets)].sum()
        assert abs(half(seen).mean() - share) < 0.01 + norm.ppf(1 - ALPHA / 4) * 0.5 / np.sqrt(n)
