"""The Gaussian process against dense NumPy, SciPy, and refits without each point."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bolfi_liquids.inference import gp as gaussian
from bolfi_liquids.inference import hyper as hyperparameters
from bolfi_liquids.inference.linalg import inverse_cholesky, log_normal_density
from scipy.stats import multivariate_normal

N = 12
condition, predict, leave_one_out, log_marginal_likelihood = map(
    jax.jit,
    (
        gaussian.condition,
        gaussian.predict,
        gaussian.leave_one_out,
        gaussian.log_marginal_likelihood,
    ),
)


@pytest.fixture(autouse=True)
def float64():
    with jax.enable_x64(True):
        yield


@pytest.fixture
def rows():
    rng = np.random.default_rng(3)
    return rng.uniform(size=(N, 2)), rng.normal(size=N)


@pytest.fixture
def hyper():
    return gaussian.Hyper(jnp.log(jnp.array([0.3, 0.8])), jnp.log(0.9), jnp.log(0.2))


def dense(a, b):
    """The kernel written out: amplitude 0.9, lengths 0.3 and 0.8, trend sd 3."""
    total = np.empty((len(a), len(b)))
    for i, p in enumerate(a):
        for j, q in enumerate(b):
            x, y = 2 * p - 1, 2 * q - 1
            smooth = 0.81 * np.exp(-0.5 * np.sum(((p - q) / [0.3, 0.8]) ** 2))
            total[i, j] = smooth + 9.0 * (1 + x @ y + x**2 @ y**2)
    return total


def test_prediction_agrees_with_dense_algebra(rows, hyper):
    u, y = rows
    new = np.array([0.4, 0.7])
    gram = dense(u, u) + (0.04 + gaussian.JITTER) * np.eye(N)
    cross = dense(u, new[None])[:, 0]
    mean, variance = predict(condition(hyper, gaussian.pad(u, y, 16)), jnp.asarray(new))
    np.testing.assert_allclose(mean, cross @ np.linalg.solve(gram, y), rtol=1e-8)
    expected = dense(new[None], new[None])[0, 0] - cross @ np.linalg.solve(gram, cross)
    np.testing.assert_allclose(variance, expected, rtol=1e-8)


def test_marginal_likelihood_agrees_with_scipy(rows, hyper):
    u, y = rows
    gram = dense(u, u) + (0.04 + gaussian.JITTER) * np.eye(N)
    value = log_marginal_likelihood(hyper, gaussian.pad(u, y, 16))
    expected = multivariate_normal(np.zeros(N), gram).logpdf(y)
    np.testing.assert_allclose(value, expected, rtol=1e-9)


def test_padding_changes_nothing(rows, hyper):
    u, y = rows
    answers = []
    for size in (N, 16, 64):
        data = gaussian.pad(u, y, size)
        fitted = condition(hyper, data)
        answers.append(
            [
                log_marginal_likelihood(hyper, data),
                *predict(fitted, jnp.array([0.1, 0.9])),
                *np.asarray(leave_one_out(fitted))[:, :N].ravel(),
            ]
        )
    np.testing.assert_allclose(answers[1], answers[0], rtol=1e-9)
    np.testing.assert_allclose(answers[2], answers[0], rtol=1e-9)


def test_leave_one_out_agrees_with_refits(rows, hyper):
    u, y = rows
    mean, variance = leave_one_out(condition(hyper, gaussian.pad(u, y, 16)))
    noise = 0.04 + gaussian.JITTER
    for i in range(N):
        rest = np.arange(N) != i
        refit = condition(hyper, gaussian.pad(u[rest], y[rest], 16))
        expected = predict(refit, jnp.asarray(u[i]))
        np.testing.assert_allclose(mean[i], expected[0], rtol=1e-7, atol=1e-10)
        np.testing.assert_allclose(variance[i], expected[1] + noise, rtol=1e-7)


def test_density_and_its_gradient_agree_with_jax(rows):
    u, y = rows
    gram = jnp.asarray(dense(u, u) + 0.1 * np.eye(N))

    def reference(matrix, y):
        constant = N / 2 * jnp.log(2 * jnp.pi)
        return jax.scipy.stats.multivariate_normal.logpdf(y, jnp.zeros(N), matrix) + constant

    np.testing.assert_allclose(log_normal_density(gram, y), reference(gram, y), rtol=1e-9)
    for ours, theirs in zip(
        jax.grad(log_normal_density, (0, 1))(gram, y),
        jax.grad(reference, (0, 1))(gram, y),
        strict=True,
    ):
        np.testing.assert_allclose(ours + ours.T, theirs + theirs.T, rtol=1e-6, atol=1e-8)


def test_inverse_cholesky_of_an_ill_conditioned_matrix():
    points = np.linspace(0.0, 1.0, 40)
    matrix = np.exp(-0.5 * (points[:, None] - points) ** 2 / 0.09) + 1e-6 * np.eye(40)
    inverse = np.asarray(inverse_cholesky(jnp.asarray(matrix)))
    np.testing.assert_allclose(inverse @ matrix @ inverse.T, np.eye(40), atol=1e-7)
    assert np.isnan(inverse_cholesky(jnp.asarray(-np.eye(3)))).any()


def test_hyperparameters_are_a_stationary_point_that_tells_inputs_apart():
    rng = np.random.default_rng(4)
    u = rng.uniform(size=(40, 2))
    y = np.sin(12 * u[:, 0]) + 0.05 * rng.normal(size=40)
    data = gaussian.pad(u, (y - y.mean()) / y.std(), 64)
    found = hyperparameters.maximum_a_posteriori(data)
    vector = jnp.append(found.log_length, jnp.array([found.log_amplitude, found.log_noise]))
    gradient = jax.grad(hyperparameters.negative_log_posterior)(vector, data)
    np.testing.assert_allclose(gradient, 0.0, atol=1e-2)
    assert found.log_length[0] < found.log_length[1] - 0.5  # only the first input matters
