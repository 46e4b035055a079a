"""The Gaussian process against dense NumPy, SciPy, and refits without each point."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bolfi_liquids.inference.gp import hyperparameters
from bolfi_liquids.inference.gp import process as gaussian
from bolfi_liquids.inference.gp.condition import believe, condition, extend
from bolfi_liquids.inference.gp.linalg import (
    BLOCK,
    inverse_cholesky,
    log_normal_density,
    small_inverse_cholesky,
)
from scipy.stats import multivariate_normal, norm

N = 12
predict, leave_one_out, log_marginal_likelihood = map(
    jax.jit,
    (gaussian.predict, gaussian.leave_one_out, gaussian.log_marginal_likelihood),
)


@pytest.fixture(autouse=True)
def float64():
    with jax.enable_x64(True):
        yield


@pytest.fixture
def rows():
    rng = np.random.default_rng(3)
    return rng.uniform(size=(N, 2)), rng.normal(size=(1, N))


@pytest.fixture
def hyper():
    return gaussian.Hyper(
        jnp.log(jnp.array([[0.3, 0.8]])), jnp.log(jnp.array([0.9])), jnp.log(jnp.array([0.2]))
    )


def dense(a, b):
    """The kernel written out: amplitude 0.9, lengths 0.3 and 0.8, trend sd 3 that fades."""
    fade = 1 / np.sqrt(1 + (np.array([0.3, 0.8]) / 0.5) ** 2)
    total = np.empty((len(a), len(b)))
    for i, p in enumerate(a):
        for j, q in enumerate(b):
            x, y = fade * (2 * p - 1), fade * (2 * q - 1)
            smooth = 0.81 * np.exp(-0.5 * np.sum(((p - q) / [0.3, 0.8]) ** 2))
            total[i, j] = smooth + 9.0 * (1 + x @ y + x**2 @ y**2)
    return total


def test_prediction_agrees_with_dense_algebra(rows, hyper):
    u, y = rows
    new = np.array([0.4, 0.7])
    gram = dense(u, u) + (0.04 + gaussian.JITTER) * np.eye(N)
    cross = dense(u, new[None])[:, 0]
    mean, variance = predict(condition(hyper, gaussian.pad(u, y, 32)), jnp.asarray(new))
    np.testing.assert_allclose(mean, cross @ np.linalg.solve(gram, y[0]), rtol=1e-8)
    expected = dense(new[None], new[None])[0, 0] - cross @ np.linalg.solve(gram, cross)
    np.testing.assert_allclose(variance, expected, rtol=1e-8)


def test_marginal_likelihood_agrees_with_scipy(rows, hyper):
    u, y = rows
    gram = dense(u, u) + (0.04 + gaussian.JITTER) * np.eye(N)
    value = log_marginal_likelihood(hyper, gaussian.pad(u, y, 32))
    expected = multivariate_normal(np.zeros(N), gram).logpdf(y[0])
    np.testing.assert_allclose(value, expected, rtol=1e-9)


@pytest.mark.slow
def test_padding_changes_nothing(rows, hyper):
    u, y = rows
    answers = []
    for size in (32, 64, 128):
        data = gaussian.pad(u, y, size)
        fitted = condition(hyper, data)
        answers.append(
            [
                *log_marginal_likelihood(hyper, data),
                *np.ravel(predict(fitted, jnp.array([0.1, 0.9]))),
                *np.asarray(leave_one_out(fitted))[:, 0, :N].ravel(),
            ]
        )
    np.testing.assert_allclose(answers[1], answers[0], rtol=1e-9)
    np.testing.assert_allclose(answers[2], answers[0], rtol=1e-9)


def test_leave_one_out_agrees_with_refits(rows, hyper):
    u, y = rows
    mean, variance = leave_one_out(condition(hyper, gaussian.pad(u, y, 32)))
    noise = 0.04 + gaussian.JITTER
    for i in range(N):
        rest = np.arange(N) != i
        refit = condition(hyper, gaussian.pad(u[rest], y[:, rest], 32))
        expected = predict(refit, jnp.asarray(u[i]))
        np.testing.assert_allclose(mean[0, i], expected[0][0], rtol=1e-7, atol=1e-10)
        np.testing.assert_allclose(variance[0, i], expected[1][0] + noise, rtol=1e-7)


def test_processes_of_a_batch_do_not_mix(rows, hyper):
    u, y = rows
    both = gaussian.pad(u, np.concatenate([y, 2.0 * y[:, ::-1]]), 32)
    twice = jax.tree.map(lambda part: jnp.concatenate([part, part + 0.1]), hyper)
    fitted = condition(twice, both)
    second = gaussian.Hyper(*(part[1:] for part in twice))
    alone = condition(second, gaussian.pad(u, 2.0 * y[:, ::-1], 32))
    new = jnp.array([0.4, 0.7])
    for together, apart in zip(predict(fitted, new), predict(alone, new), strict=True):
        np.testing.assert_allclose(together[1:], apart, rtol=1e-9)


def test_joint_prediction_agrees_with_dense_algebra(rows, hyper):
    u, y = rows
    a, b = np.array([[0.4, 0.7], [0.1, 0.2]]), np.array([[0.5, 0.5], [0.9, 0.1], [0.4, 0.7]])
    noisy = dense(u, u) + (0.04 + gaussian.JITTER) * np.eye(N)
    expected = dense(a, b) - dense(a, u) @ np.linalg.solve(noisy, dense(u, b))
    fitted = condition(hyper, gaussian.pad(u, y, 32))
    found = jax.jit(gaussian.predict_joint)(fitted, jnp.asarray(a), jnp.asarray(b))[0]
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-10)


def test_believing_agrees_with_conditioning_on_the_mean(rows, hyper):
    u, y = rows
    fitted = condition(hyper, gaussian.pad(u, y, 32))
    new = np.array([[0.4, 0.7], [0.1, 0.2]])
    mean = np.stack([predict(fitted, jnp.asarray(point))[0] for point in new], axis=1)
    again = condition(
        hyper, gaussian.pad(np.concatenate([u, new]), np.concatenate([y, mean], axis=1), 32)
    )
    believing = believe(fitted, new)
    at = jnp.array([0.3, 0.3])
    for one, other in zip(predict(believing, at), predict(again, at), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    with pytest.raises(ValueError, match="32 reserved"):
        believe(fitted, np.full((21, 2), 0.5))


@pytest.mark.parametrize("first", [20, 32, 50])
def test_growing_agrees_with_conditioning_on_all(first, hyper):
    """Within a block, at the end of one and over one; also where the first data changed."""
    rng = np.random.default_rng(5)
    u, y = rng.uniform(size=(70, 2)), rng.normal(size=(1, 70))
    data = gaussian.pad(u, y, 96)
    expected = condition(hyper, data)
    changed = np.concatenate([u[1 : first + 1], u[:1]])[:first]
    for before in (u[:first], changed):
        grown = extend(condition(hyper, gaussian.pad(before, y[:, :first], 96)), data)
        np.testing.assert_allclose(grown.whitener, expected.whitener, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(grown.weights, expected.weights, rtol=1e-7, atol=1e-9)


def test_coordinates_of_a_prior_that_fades_out_are_its_normal_scores(rows, hyper):
    """A process over normal scores is one over quantiles that lie where the scores do."""
    u, y = rows
    scores = 0.5 + norm.ppf(u[:, 0]) / np.sqrt(12.0)
    moved = np.column_stack([scores, u[:, 1]])
    there = condition(hyper, gaussian.pad(u, y, 32, np.array([True, False])))
    same = condition(hyper, gaussian.pad(moved, y, 32))
    for one, other in zip(
        predict(there, jnp.asarray(u[0])), predict(same, jnp.asarray(moved[0])), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    for part in (*predict(there, jnp.zeros(2)), *predict(there, jnp.ones(2))):
        assert np.isfinite(part).all()


@pytest.mark.slow
@pytest.mark.parametrize("used", [12, *(pytest.param(n, marks=pytest.mark.slow) for n in (40, 64))])
def test_density_and_its_gradient_agree_with_jax(used):
    """Over one block, part of a second, and two whole ones."""
    rng = np.random.default_rng(3)
    u, size = rng.uniform(size=(64, 2)), 64
    inside = np.arange(size) < used
    full = dense(u, u) + 0.1 * np.eye(size)
    gram = jnp.asarray(np.where(inside[:, None] & inside, full, np.eye(size)))
    y = jnp.asarray(rng.normal(size=size) * inside)

    def rows_of(matrix, _, start):
        return jax.lax.dynamic_slice(matrix, (start, 0), (BLOCK, size))

    def reference(matrix):
        density = jax.scipy.stats.multivariate_normal.logpdf
        constant = used / 2 * jnp.log(2 * jnp.pi)
        return density(y[:used], jnp.zeros(used), matrix[:used, :used]) + constant

    def ours(matrix):
        return log_normal_density(rows_of, matrix, (), y, used)

    np.testing.assert_allclose(ours(gram), reference(gram), rtol=1e-9)
    one, other = jax.grad(ours)(gram), jax.grad(reference)(gram)
    one = np.where(inside[:, None] & inside, one, 0.0)
    np.testing.assert_allclose(one + one.T, other + other.T, rtol=1e-6, atol=1e-8)


def test_inverse_cholesky_of_an_ill_conditioned_matrix():
    points = np.linspace(0.0, 1.0, 64)
    matrix = np.exp(-0.5 * (points[:, None] - points) ** 2 / 0.09) + 1e-6 * np.eye(64)

    def inverted(matrix, n):
        def rows(start):
            return jax.lax.dynamic_slice(matrix, (start, 0), (BLOCK, len(matrix)))

        return np.asarray(inverse_cholesky(rows, n, jnp.eye(len(matrix))))

    inverse = inverted(jnp.asarray(matrix), 64)
    np.testing.assert_allclose(inverse @ matrix @ inverse.T, np.eye(64), atol=1e-7)
    assert np.isnan(inverted(jnp.asarray(-np.eye(32)), 3)).any()
    small = np.asarray(small_inverse_cholesky(jnp.asarray(matrix[:5, :5])))
    np.testing.assert_allclose(small @ matrix[:5, :5] @ small.T, np.eye(5), atol=1e-7)


@pytest.mark.slow
def test_hyperparameters_are_a_stationary_point_that_tells_inputs_apart():
    rng = np.random.default_rng(4)
    u = rng.uniform(size=(40, 2))
    y = np.sin(12 * u[:, 0]) + 0.05 * rng.normal(size=40)
    targets = np.stack([(y - y.mean()) / y.std(), 2.0 * u[:, 1] - 1.0])
    data = gaussian.pad(u, targets, 64)
    found = hyperparameters.maximum_a_posteriori(data)

    def total(vectors):
        hyper = hyperparameters.unpack(jnp.asarray(vectors))
        evidence = log_marginal_likelihood(hyper, data)
        return -jnp.sum(evidence + hyperparameters.log_prior(hyper))

    gradient = jax.grad(total)(jnp.asarray(hyperparameters.pack(found)))
    np.testing.assert_allclose(gradient, 0.0, atol=0.1)  # optimisers stop at gains of 1e-3
    assert found.log_length[0, 0] < found.log_length[0, 1] - 0.5  # only the first input matters
    warm = hyperparameters.maximum_a_posteriori(data, found)
    np.testing.assert_allclose(
        total(hyperparameters.pack(warm)), total(hyperparameters.pack(found)), atol=1e-2
    )


@pytest.mark.slow
def test_processes_that_are_not_wanted_stay_out():
    rng = np.random.default_rng(6)
    u, y = rng.uniform(size=(20, 2)), rng.normal(size=(2, 20))
    both, first = gaussian.pad(u, y, 32), gaussian.pad(u, y[:1], 32)
    silent = gaussian.pad(u, np.stack([y[0], np.zeros(20)]), 32)
    alone = hyperparameters.pack(hyperparameters.maximum_a_posteriori(first))
    for data in (both, silent):
        found = hyperparameters.pack(hyperparameters.maximum_a_posteriori(data))
        np.testing.assert_array_equal(found[0], alone[0])
    np.testing.assert_array_equal(found[1], hyperparameters.prior_moments(2)[0])
