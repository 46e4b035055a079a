"""Are the tasks' exact posteriors exact? Against closed forms, brute force and identities."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import chi2, multivariate_normal, norm
from tasks import TASKS, make_reference, score
from tasks.gauss import COVARIANCE, SIZE
from tasks.ma import from_square, to_square
from tasks.pendulum import NOISE, STEP
from tasks.reference import mean_and_sd

ALPHA = 1e-4  # false alarms per test
TRUTH = {
    "gauss2": (0.7, -0.4),
    "ma2": tuple(float(u) for u in to_square(0.6, 0.2)),
    "pend2": (0.25, 0.15),
    "pendobs": (0.25, 0.15),
    "pendobs3": (0.25, 0.15, 20.0),
}


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
    assert not np.array_equal(together, task.simulate(task.theta(points), seeds + 1))


def test_discrepancies_and_views_fit_the_data(task):
    observed = task.observe(0)
    signals = task.simulate(task.theta(prior_draws(task, 3)), np.arange(3))
    assert all(task.discrepancy(observed, signal) > 0.0 for signal in signals)
    view = task.view(signals)
    assert task.view(observed[None]).shape[1:] == view.shape[1:]
    assert task.noise is None or task.noise.shape == (view.shape[1],) * 2


@pytest.mark.slow
def test_scores_of_the_likelihood_average_to_zero_and_vary_by_the_information(task):
    """At the truth, over data sets: E s = 0 and E s s' = -E H (first and second Bartlett identity).

    Data drawn otherwise than the likelihood says break them: 100 data sets show a mean off by
    half an sd, or a variance off by a factor of 1.8.
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
    scores = [score(o, g, task.bounds) for o, g in zip(other, (coarse, fine), strict=True)]
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
    found = score(task.log_likelihood(moved, task.theta(reference.points)), reference, task.bounds)
    difference = (moved - observed).mean(axis=0)
    distance = np.sqrt(difference @ np.linalg.inv(COVARIANCE / SIZE) @ difference)
    assert found.total_variation == pytest.approx(2 * norm.cdf(distance / 2) - 1, abs=2e-3)
    assert found.mean_error == pytest.approx(np.linalg.norm(difference) / np.sqrt(2) / 8, abs=1e-3)
    assert found.sd_ratio == pytest.approx(1.0, abs=0.03)


def test_score_of_a_wider_normal():
    """Twice the sd in two dimensions: TV = 1/4^(1/3) - 1/4^(4/3), where the densities cross."""
    task = TASKS["gauss2"]
    reference = make_reference(task, task.observe(0))
    log_density = task.log_likelihood(task.observe(0), task.theta(reference.points)) / 4.0
    found = score(log_density, reference, task.bounds)
    assert found.total_variation == pytest.approx(4 ** (-1 / 3) - 4 ** (-4 / 3), abs=2e-3)
    assert found.sd_ratio == pytest.approx(2.0, abs=0.01)
    assert found.mean_error < 1e-3


def test_densities_that_mean_nothing_are_refused():
    task = TASKS["gauss2"]
    reference = make_reference(task, task.observe(0), cells=20)
    for value in (np.nan, -np.inf, np.inf):
        with pytest.raises(ValueError, match="log densities"):
            score(np.full(400, value), reference, task.bounds)
