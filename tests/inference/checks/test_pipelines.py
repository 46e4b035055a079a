"""The engine as a pipeline: one that simulates anew, and one whose design is shared."""

import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from bolfi_liquids import inference

pytestmark = pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.EmulatorWarning")

SHORT = {"sampler": "emcee", "chains": 2, "draws": 64, "warmup": 20}


@pytest.mark.slow
def test_fit_pipeline_is_fit_and_sample(simulate, prior, observed):
    pipeline = inference.FitPipeline(simulate, prior, 8, {"surrogate": "discrepancy"}, SHORT)
    drawn, log_density = pipeline(observed, 3)
    fit = inference.fit(simulate, prior, observed, budget=8, seed=3, surrogate="discrepancy")
    expected = fit.sample(seed=3, **SHORT)
    for name in prior.names:
        np.testing.assert_array_equal(drawn["posterior"][name], expected["posterior"][name])
    theta = {"slope": np.array([0.1, 0.2]), "offset": np.array([0.5, 0.5])}
    np.testing.assert_array_equal(log_density(theta), fit.log_prob(theta))


@pytest.mark.slow
def test_a_shared_design_is_simulated_once(simulate, prior):
    calls = []

    def counted(theta, seeds):
        calls.extend(seeds)
        return simulate(theta, seeds)

    options = {"surrogate": "discrepancy"}
    pipeline = inference.shared_design(counted, prior, 10, options=options, sampling=SHORT)
    assert len(calls) == len(set(calls)) == 10
    made = inference.replicates(pipeline, n=2, draws=7)
    assert len(calls) == len(set(calls)) == 12  # and one for the data of each replicate
    assert not made.failed and made.finished[0].log_density is not None
    assert not np.array_equal(made.draws[0], made.draws[1])


def test_a_shared_design_survives_failed_simulations(simulate, prior):
    def fragile(theta, seeds):
        if (theta["slope"] > 0.5).any():
            raise ArithmeticError("burst")
        return simulate(theta, seeds)

    pipeline = inference.shared_design(fragile, prior, 12)
    failed = np.isnan(pipeline.signals).all(-1)
    np.testing.assert_array_equal(failed, pipeline.theta[:, 0] > 0.5)
    assert 0 < failed.sum() < 12

    def broken(theta, seeds):
        raise ArithmeticError("burst")

    with pytest.raises(RuntimeError, match="0 of 5 simulations succeeded.*burst"):
        inference.shared_design(broken, prior, 5)


@pytest.mark.slow
def test_pipelines_travel_to_spawned_processes(monkeypatch):
    """Both kinds, on two processes, give what one process gives."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1]))
    import closed_form

    simulate, prior = closed_form.TASKS["decay"]
    options = {"surrogate": "discrepancy"}
    pipelines = [
        inference.FitPipeline(simulate, prior, 9, options, SHORT),
        inference.shared_design(simulate, prior, 12, options=options, sampling=SHORT),
    ]
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=spawn) as pool:
        for pipeline in pipelines:
            again = pickle.loads(pickle.dumps(pipeline))
            spread = inference.replicates(again, n=4, draws=7, executor=pool)
            np.testing.assert_array_equal(
                spread.draws, inference.replicates(pipeline, n=4, draws=7).draws
            )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"budget": -2}, "budget must be an integer from 3"),
        ({"simulate": 3}, "simulate must be a function, got 3"),
        ({"options": {"nosie": 1}}, "surrogate 'signal' has the options"),
    ],
)
def test_a_pipeline_that_can_only_fail_is_refused(simulate, prior, change, message):
    given = {"simulate": simulate, "prior": prior, **change}
    with pytest.raises(ValueError, match=message):
        inference.FitPipeline(**given)


def test_what_cannot_be_run_is_refused(simulate, prior):
    pipeline = inference.FitPipeline(simulate, prior)
    for wrong in ({"executor": 3}, {"observe": 3}, {"simulate": 3}):
        with pytest.raises(ValueError, match=f"{next(iter(wrong))} must be"):
            inference.replicates(pipeline, n=2, **wrong)
    with pytest.raises(ValueError, match="pipeline must be a function, got 3"):
        inference.sbc(3)
