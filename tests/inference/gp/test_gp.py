"""The Gaussian process against dense NumPy, SciPy, and refits without each point."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bolfi_liquids.inference.gp import hyperparameters
from bolfi_liquids.inference.gp.hyperparameters import log_marginal_likelihood
from bolfi_liquids.inference.gp.process import (
    BOTH_TAILS,
    JITTER,
    UPPER_TAIL,
    Cheap,
    Data,
    Hyper,
    condition,
    coordinates,
    fantasize,
    inverse_cholesky,
    leave_one_out,
    padded,
    predict,
    predict_joint,
)
from scipy.stats import multivariate_normal, norm

N = 12
HYPER = Hyper(np.log([[0.3, 0.8]]), np.log([0.9]), np.log([0.2]))
NOISE = 0.04 + JITTER


@pytest.fixture
def rows():
    rng = np.random.default_rng(3)
    return rng.uniform(size=(N, 2)), rng.normal(size=(1, N))


def dense(a, b, unit=1.0):
    """The kernel written out: amplitude 0.9, lengths 0.3 and 0.8, trend sd 3 that fades."""
    fade = 1 / np.sqrt(1 + (np.array([0.3, 0.8]) / 0.5) ** 2)
    total = np.empty((len(a), len(b)))
    for i, p in enumerate(a):
        for j, q in enumerate(b):
            x, y = fade * (2 * p - 1), fade * (2 * q - 1)
            smooth = 0.81 * np.exp(-0.5 * np.sum(((p - q) / [0.3, 0.8]) ** 2))
            total[i, j] = smooth + 9.0 * unit**2 * (1 + x @ y + x**2 @ y**2)
    return total


def test_prediction_agrees_with_dense_algebra(rows):
    u, y = rows
    new = np.random.default_rng(0).uniform(size=(300, 2))  # more than one batch
    gram, cross = dense(u, u) + NOISE * np.eye(N), dense(u, new)
    fitted = condition(HYPER, Data(u, y))
    mean, variance = predict(fitted, new)
    np.testing.assert_allclose(mean[0], cross.T @ np.linalg.solve(gram, y[0]), rtol=1e-8)
    joint = dense(new[:9], new) - cross[:, :9].T @ np.linalg.solve(gram, cross)
    np.testing.assert_allclose(variance[0, :9], np.diag(joint), rtol=1e-7)
    alone = [dense(point[None], point[None])[0, 0] for point in new]
    expected = alone - np.sum(cross * np.linalg.solve(gram, cross), axis=0)
    np.testing.assert_allclose(variance[0], expected, rtol=1e-7)
    found = predict_joint(fitted, new[:9], new)[0]
    np.testing.assert_allclose(found, joint, rtol=1e-8, atol=1e-9)


def test_jax_predicts_what_numpy_does(rows):
    """NUTS follows the same function, padded, by JAX."""
    fitted = condition(HYPER, Data(*rows, np.array([True, False])))
    new = np.array([[0.4, 0.7], [0.0, 1.0]])
    with jax.enable_x64(True):
        traced = jax.jit(predict)(padded(fitted, 3), jnp.asarray(new))
    for one, other in zip(traced, predict(fitted, new), strict=True):
        np.testing.assert_allclose(one[:1], other, rtol=1e-9)


def test_leave_one_out_agrees_with_refits(rows):
    u, y = rows
    mean, variance = leave_one_out(condition(HYPER, Data(u, y)))
    for i in range(N):
        rest = np.arange(N) != i
        expected = predict(condition(HYPER, Data(u[rest], y[:, rest])), u[i : i + 1])
        np.testing.assert_allclose(mean[0, i], expected[0][0, 0], rtol=1e-7, atol=1e-10)
        np.testing.assert_allclose(variance[0, i], expected[1][0, 0] + NOISE, rtol=1e-7)


def test_what_is_found_of_a_process_depends_on_no_other():
    """Not a bit, wherever processes are computed together: at few runs, and not at many."""
    rng = np.random.default_rng(2)
    for n in (14, 100):
        data = Data(rng.random((n, 2)), rng.standard_normal((8, n)))
        hyper = Hyper(rng.normal(size=(8, 2)), rng.normal(size=8), rng.normal(size=8) - 1.0)
        together = log_marginal_likelihood(hyper, data)
        for i in range(8):
            own = Hyper(*(part[i : i + 1] for part in hyper)), data._replace(y=data.y[i : i + 1])
            for whole, alone in zip(together, log_marginal_likelihood(*own), strict=True):
                np.testing.assert_array_equal(whole[i], alone[0])
        one, other = (predict(condition(*of), data.u)[0] for of in ((hyper, data), own))
        np.testing.assert_allclose(one[-1:], other, rtol=1e-7, atol=1e-9)


@pytest.fixture
def helped(rows):
    """Processes that a cheap simulator's 20 runs say much of, and these runs."""
    rng = np.random.default_rng(8)
    there, cheap = rng.uniform(size=(20, 2)), rng.normal(size=(1, 20))
    known = condition(HYPER, Data(there, cheap))
    prior = Cheap(known, *(np.array([number]) for number in (0.7, 0.4, 0.1)))
    return condition(HYPER, Data(*rows), prior), there, cheap


def test_cheap_runs_make_it_cokriging(rows, helped):
    """All runs at once, by the joint covariance of both simulators (Kennedy and O'Hagan 2000)."""
    (u, y), (fitted, there, cheap) = rows, helped
    new = np.random.default_rng(0).uniform(size=(300, 2))

    def dear(a, b):
        return 0.7**2 * dense(a, b) + dense(a, b, 0.1)

    across = 0.7 * dense(there, u)
    gram = np.block([[dense(there, there), across], [across.T, dear(u, u)]]) + NOISE * np.eye(32)
    cross = np.concatenate([0.7 * dense(there, new), dear(u, new)])
    mean, variance = predict(fitted, new)
    due = np.linalg.solve(gram, np.concatenate([cheap[0], y[0] - 0.4]))
    np.testing.assert_allclose(mean[0], 0.4 + cross.T @ due, rtol=1e-6, atol=1e-8)
    joint = dear(new[:9], new) - cross[:, :9].T @ np.linalg.solve(gram, cross)
    np.testing.assert_allclose(variance[0, :9], np.diag(joint), rtol=1e-6)
    np.testing.assert_allclose(predict_joint(fitted, new[:9], new)[0], joint, rtol=1e-6, atol=1e-8)
    with jax.enable_x64(True):
        traced = jax.jit(predict)(padded(fitted, 3), jnp.asarray(new[:5]))
    for one, other in zip(traced, (mean, variance), strict=True):
        np.testing.assert_allclose(one[:1], other[:, :5], rtol=1e-8)


def test_cheap_runs_are_known_over_coordinates(rows, helped):
    (u, y), (fitted, *_) = rows, helped
    tails = np.array([BOTH_TAILS, UPPER_TAIL])
    with_tails = condition(HYPER, Data(u, y, tails), fitted.prior)
    flat = condition(HYPER, Data(coordinates(u, tails), y), fitted.prior)
    new = np.random.default_rng(0).uniform(size=(9, 2))
    at = coordinates(new, tails)
    for one, other in zip(predict(with_tails, new), predict(flat, at), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    joint = predict_joint(with_tails, new, new), predict_joint(flat, at, at)
    np.testing.assert_allclose(*joint, rtol=1e-9, atol=1e-12)


def test_cheap_runs_stay_while_others_are_left_out_or_fantasised(rows, helped):
    (u, y), (fitted, *_) = rows, helped
    mean, variance = leave_one_out(fitted)
    for i in range(N):
        rest = np.arange(N) != i
        refitted = condition(HYPER, Data(u[rest], y[:, rest]), fitted.prior)
        expected = predict(refitted, u[i : i + 1])
        np.testing.assert_allclose(mean[0, i], expected[0][0, 0], rtol=1e-7, atol=1e-10)
        np.testing.assert_allclose(variance[0, i], expected[1][0, 0] + NOISE, rtol=1e-7)
    new = np.array([[0.4, 0.7], [0.1, 0.2]])
    believed = predict(fantasize(fitted, new), new)
    np.testing.assert_allclose(believed[0], predict(fitted, new)[0], rtol=1e-7)
    assert (believed[1] < predict(fitted, new)[1]).all()


@pytest.mark.parametrize("given", [True, False])
def test_fantasies_have_the_spread_that_is_given_or_the_median(rows, given):
    u, y = rows
    spread, new = np.linspace(0.5, 2.0, N), np.array([[0.4, 0.7], [0.1, 0.2]])
    due = np.array([0.6, 3.0]) if given else np.full(2, np.median(spread))
    fitted = condition(HYPER, Data(u, y, spread=spread))
    mean = predict(fitted, new)[0]
    both = np.concatenate([u, new]), np.concatenate([y, mean], axis=1)
    again = condition(HYPER, Data(*both, spread=np.concatenate([spread, due])))
    fantasized = fantasize(fitted, new, due if given else None)
    for one, other in zip(predict(fantasized, u), predict(again, u), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    np.testing.assert_allclose(predict(fantasized, u)[0], predict(fitted, u)[0], rtol=1e-7)


def test_coordinates_of_a_prior_that_fades_out_are_its_normal_scores(rows):
    """A process over normal scores is one over quantiles that lie where the scores do."""
    u, y = rows
    moved = np.column_stack([0.5 + norm.ppf(u[:, 0]) / np.sqrt(12.0), u[:, 1]])
    there, same = (
        condition(HYPER, Data(u, y, np.array([True, False]))),
        condition(HYPER, Data(moved, y)),
    )
    for one, other in zip(predict(there, u), predict(same, moved), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-7)
    for part in predict(there, np.array([[0.0, 0.0], [1.0, 1.0]])):
        assert np.isfinite(part).all()


def test_the_marginal_likelihood_is_scipys_and_its_gradient_its_slope(rows):
    u, y = rows
    value, _ = log_marginal_likelihood(HYPER, Data(u, y))
    expected = multivariate_normal(np.zeros(N), dense(u, u) + NOISE * np.eye(N)).logpdf(y[0])
    np.testing.assert_allclose(value, expected, rtol=1e-9)
    data = Data(u, np.concatenate([y, y[:, ::-1]]))
    vectors = np.tile(hyperparameters.pack(HYPER), (2, 1)) + [[0.0], [0.3]]
    found = hyperparameters.negative_log_posterior(vectors, data)[1]
    for j, step in enumerate(1e-5 * np.eye(4)):
        above, below = (
            hyperparameters.negative_log_posterior(vectors + sign * step, data)[0]
            for sign in (1, -1)
        )
        np.testing.assert_allclose(found[:, j], (above - below) / 2e-5, rtol=1e-6, atol=1e-6)


def test_inverse_cholesky_of_an_ill_conditioned_matrix():
    points = np.linspace(0.0, 1.0, 64)
    matrix = np.exp(-0.5 * (points[:, None] - points) ** 2 / 0.09) + 1e-6 * np.eye(64)
    inverse = inverse_cholesky(matrix)
    np.testing.assert_allclose(inverse @ matrix @ inverse.T, np.eye(64), atol=1e-7)
    assert np.isnan(inverse_cholesky(-np.eye(32))).any()


def test_hyperparameters_are_a_stationary_point_that_tells_inputs_apart():
    rng = np.random.default_rng(4)
    u = rng.uniform(size=(40, 2))
    y = np.sin(12 * u[:, 0]) + 0.05 * rng.normal(size=40)
    # the second process depends on the other input, the third teaches nothing
    targets = np.stack([(y - y.mean()) / y.std(), 2.0 * u[:, 1] - 1.0, np.zeros(40)])
    data = Data(u, targets)
    found = hyperparameters.maximum_a_posteriori(data)
    packed = hyperparameters.pack(found)
    np.testing.assert_array_equal(packed[2], hyperparameters.prior_moments(2)[0])
    first = hyperparameters.maximum_a_posteriori(data._replace(y=targets[:1]))
    np.testing.assert_array_equal(packed[0], hyperparameters.pack(first)[0])

    def posterior(hyper):
        value, gradient = hyperparameters.negative_log_posterior(hyperparameters.pack(hyper), data)
        return value[:2], gradient[:2]

    value, gradient = posterior(found)
    np.testing.assert_allclose(gradient, 0.0, atol=0.1)  # optimisers stop at gains of 1e-3
    assert found.log_length[0, 0] < found.log_length[0, 1] - 0.5  # only the first input matters
    warm = hyperparameters.maximum_a_posteriori(data, found)
    np.testing.assert_allclose(posterior(warm)[0], value, atol=1e-2)
