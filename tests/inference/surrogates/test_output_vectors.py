import numpy as np
import pytest
from bolfi_liquids.inference.surrogates.emulator import principal_components
from bolfi_liquids.inference.surrogates.output_vectors import MAX_VALUES, describe


def test_channels_follow_each_other_and_missing_samples_are_left_out():
    observed = np.arange(40.0).reshape(20, 2)
    observed[[3, 7], 1] = np.nan
    output = describe(observed, None)
    values = output.values(np.arange(40.0).reshape(20, 2))
    np.testing.assert_array_equal(values[:20], np.arange(0.0, 40.0, 2.0))
    np.testing.assert_array_equal(values[20:24], [1.0, 3.0, 5.0, 9.0])
    assert (output.layout.channel == np.repeat([0, 1], [20, 18])).all()
    assert list(output.layout.sample[20:24]) == [0, 1, 2, 4]
    restored = output.restore(values[None])[0]
    np.testing.assert_array_equal(np.isnan(restored), np.isnan(observed))
    np.testing.assert_array_equal(restored[np.isfinite(observed)], observed[np.isfinite(observed)])


def test_a_long_series_is_averaged_over_neighbours():
    m = 3 * MAX_VALUES
    output = describe(np.zeros(m), None)
    values = output.values(np.arange(m, dtype=float))
    assert len(values) == MAX_VALUES
    np.testing.assert_array_equal(values[:3], [1.0, 4.0, 7.0])
    assert output.restore(values[None]).shape == (1, m)


def test_a_summary_is_no_series_and_its_values_are_scaled_one_by_one():
    output = describe(np.zeros((30, 2)), lambda signal: np.array([signal.sum(), signal.max()] * 10))
    assert not output.series
    values = np.random.default_rng(0).normal(size=(8, 20)) * np.logspace(-6.0, 6.0, 20)
    np.testing.assert_allclose(output.scale(values), values.std(0))


def test_channels_of_a_series_have_one_scale_each():
    output = describe(np.zeros((20, 2)), None)
    values = np.random.default_rng(0).normal(size=(500, 40)) * np.repeat([1.0, 1e4], 20)
    scale = output.scale(values)
    assert len(np.unique(scale)) == 2
    np.testing.assert_allclose(scale[[0, -1]], [1.0, 1e4], rtol=0.05)


def test_wrong_shapes_and_nothing_observed_are_refused():
    with pytest.raises(ValueError, match=r"output of shape \(20,\), as observed, got \(3,\)"):
        describe(np.zeros(20), None).values(np.zeros(3))
    with pytest.raises(ValueError, match="must have a finite value"):
        describe(np.full(5, np.nan), None)


def test_components_agree_with_the_singular_values():
    rng = np.random.default_rng(0)
    outputs = rng.normal(size=(12, 3)) @ rng.normal(size=(3, 40)) + 5.0
    basis = principal_components(outputs, np.full(40, 2.0), 8, 0.9995)
    assert basis.used == 3
    singular = np.linalg.svd((outputs - outputs.mean(0)) / 2.0, compute_uv=False)[:3]
    np.testing.assert_allclose(
        np.linalg.norm(basis.vectors[:, :3], axis=0), singular / np.sqrt(12), rtol=1e-8
    )
    scores = basis.scores(outputs)
    np.testing.assert_allclose(scores[:, :3].std(0), 1.0)
    assert not scores[:, 3:].any()
    np.testing.assert_allclose(basis.residuals(outputs), 0.0, atol=1e-10)


def test_as_many_components_as_explain_the_share():
    outputs = (
        np.diag([10.0, 1.0, 0.1, 0.0])
        @ np.linalg.qr(np.random.default_rng(0).normal(size=(9, 4)))[0].T
    )
    for share, used in [(0.9, 1), (0.999, 2), (0.999999, 3)]:
        centred = np.concatenate([outputs, -outputs])
        assert principal_components(centred, np.ones(9), 8, share).used == used


def test_constant_outputs_have_no_component():
    assert principal_components(np.ones((5, 7)), np.ones(7), 4, 0.9995).used == 0
