"""The engine as a pipeline: one that simulates anew, and one whose design is shared."""

import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.inference.describe import describe

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
    theta, signals, _ = pipeline.options["earlier"]
    failed = np.isnan(signals).all(-1)
    np.testing.assert_array_equal(failed, theta["slope"] > 0.5)
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


def test_a_design_s_simulations_are_kept_batch_by_batch(simulate, prior):
    """What was finished before a crash is not simulated again, and the bank stays open."""
    made, told = [], []

    def mortal(theta, seeds):
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(list(seeds))
        return simulate(theta, seeds)

    with inference.SimulationBank() as bank:
        given = {"bank": bank, "identity": "line", "batch": 3}
        with pytest.raises(KeyboardInterrupt):
            inference.shared_design(mortal, prior, 8, **given)
        assert [len(batch) for batch in made] == [3, 3] and len(bank) == 6
        design = inference.shared_design(simulate, prior, 8, progress=told.append, **given)
        assert len(bank) == 8
    assert told == [1] * 8
    anew = inference.shared_design(simulate, prior, 8)
    np.testing.assert_array_equal(design.options["earlier"][1], anew.options["earlier"][1])


def single(theta, seed):
    """The line of a single run."""
    assert isinstance(theta["slope"], float) and isinstance(seed, int)
    return closed_line({name: np.array([value]) for name, value in theta.items()}, [seed])[0]


def closed_line(theta, seeds):
    time_ = np.linspace(0.0, 1.0, 30)
    return theta["slope"][:, None] * time_ + theta["offset"][:, None]


@pytest.mark.slow
def test_a_pipeline_of_single_runs_makes_data_for_its_replicates(prior):
    options = {"vectorised": False, "surrogate": "discrepancy"}
    short = {"sampler": "quadrature", "chains": 2, "draws": 32}
    pipeline = inference.FitPipeline(single, prior, 8, options, short)
    design = inference.shared_design(single, prior, 8, options=options, sampling=short)
    theta, signals, seeds = design.options["earlier"]
    np.testing.assert_array_equal(signals, closed_line(theta, seeds))
    given = {"n": 2, "draws": 7, "progress": False}
    for one, batched in (
        (
            pipeline,
            inference.FitPipeline(closed_line, prior, 8, {"surrogate": "discrepancy"}, short),
        ),
        (design, design),
    ):
        made = inference.replicates(one, **given)
        assert made.errors == {}
        expected = inference.replicates(batched, **given)
        np.testing.assert_array_equal(made.draws, expected.draws)


def test_a_display_switch_is_no_setting(simulate, prior):
    loud, silent = (inference.FitPipeline(simulate, prior, warn=warn) for warn in (True, False))
    assert loud == silent and describe(loud) == describe(silent)
    design = inference.shared_design(simulate, prior, 4)
    assert describe(design) == describe(replace(design, warn=False))
    assert describe(design) != describe(inference.shared_design(simulate, prior, 5))
