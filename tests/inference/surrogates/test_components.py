"""Principal components, whichever of simulations and values are more."""

import tracemalloc

import numpy as np
import pytest
from bolfi_liquids.inference.surrogates.emulator import principal_components


@pytest.mark.parametrize(("n", "m"), [(9, 40), (40, 40), (200, 7)])
def test_components_are_those_of_the_singular_values(n, m):
    rng = np.random.default_rng(0)
    outputs = rng.normal(size=(n, m)) @ np.diag(0.7 ** np.arange(m)) + 3.0
    basis = principal_components(outputs, np.full(m, 2.0), 5, 0.9999)
    standard = (outputs - outputs.mean(0)) / 2.0
    _, sizes, right = np.linalg.svd(standard, full_matrices=False)
    exact = right[:5].T * sizes[:5] / np.sqrt(n)
    np.testing.assert_allclose(basis.vectors @ basis.vectors.T, exact @ exact.T, atol=1e-10)
    assert basis.explained == pytest.approx(np.sum(sizes[:5] ** 2) / np.sum(sizes**2))
    np.testing.assert_allclose(basis.scores(outputs).std(0), 1.0)


def test_many_simulations_of_few_values_need_no_matrix_of_simulations():
    """That matrix would hold 3 GB; components of its size take hours."""
    outputs = np.random.default_rng(0).normal(size=(20_000, 6))
    tracemalloc.start()
    try:
        basis = principal_components(outputs, np.ones(6), 8, 0.9995)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert basis.used == 6 and peak < 20 * outputs.nbytes
