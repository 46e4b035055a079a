"""What makes no sense is refused by its name, before anything is simulated."""

import re
from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism

from bolfi_liquids import inference

NOISE = criticism.KnownNoise(0.01)
OBSERVED = np.linspace(0.0, 1.0, 30)
POSITIVE = dist.HalfNormal(1.0)
ONES = np.ones((9, 1))


def never(theta, seeds):
    raise AssertionError("simulated")


def other(theta, seeds):
    raise AssertionError("simulated")


def experiment(**changed):
    given = {"simulate": never, "observed": OBSERVED, "noise": NOISE, **changed}
    return criticism.Experiment(**given)


def proposal(**changed):
    return criticism.Proposal(**{"simulate": never, "noise": NOISE, "shape": (30,), **changed})


def clean(residual=ONES, noise=NOISE, **how):
    return criticism.CleanData(residual, noise, **how)


OTHER_SDS = criticism.KnownNoise(np.full(7, 0.01))
GAPPY = np.where(np.arange(30) == 3, np.nan, OBSERVED)
UNSEEN = experiment(observed=np.zeros(30), label="unseen")
GOOD = {
    "experiment": experiment(),
    "prior": inference.Prior({"thickness": dist.Uniform(0.0, 1.0)}),
    "extensions": {"drift": criticism.Extension(POSITIVE)},
}


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"experiment": 3}, "experiment"),
        ({"prior": {"a": POSITIVE}}, "prior"),
        ({"extensions": ["drift"]}, "extensions"),
        ({"extensions": {"drift": POSITIVE}}, "drift"),
        ({"extensions": {"thickness": criticism.Extension(POSITIVE)}}, "thickness"),
        ({"earlier": ({"thickness": [0.5]}, np.zeros((1, 30)))}, "earlier"),
        ({"held_out": UNSEEN}, "held_out"),
        ({"experiment": experiment(noise=OTHER_SDS)}, "noise"),
        ({"held_out": [replace(UNSEEN, noise=OTHER_SDS)]}, "unseen"),
        ({"held_out": [experiment(observed=OBSERVED.copy(), label="copy")]}, "copy"),
        (
            {"experiment": experiment(observed=GAPPY), "held_out": [experiment(observed=GAPPY)]},
            "held-out",
        ),
        ({"held_out": [UNSEEN, replace(UNSEEN, simulate=other)]}, "unseen"),
        ({"proposals": [UNSEEN]}, "proposals"),
        ({"proposals": [proposal(), proposal(simulate=other)]}, "identity"),
        ({"accept": ["drfit"]}, "drfit"),
        ({"level": np.nan}, "level"),
        ({"plan": 3}, "plan"),
        ({"report": "loud"}, "report"),
        ({"executor": 3}, "executor"),
        ({"bank": 3}, "bank"),
        ({"batch": 0}, "batch"),
        ({"seed": -1}, "seed"),
        ({"timeout": -1.0}, "timeout"),
    ],
)
def test_a_criticism_is_refused(wrong, named):
    with pytest.raises(ValueError, match=rf"\b{named}\b"):
        criticism.criticise(**GOOD | wrong)


def test_experiments_that_the_bank_tells_apart_are_simulated():
    for apart in ({"label": "b"}, {"identity": "b"}, {"simulate": never}):
        second = replace(UNSEEN, **{"simulate": other, **apart})
        with pytest.raises(RuntimeError, match="AssertionError: simulated"):
            criticism.criticise(**GOOD, held_out=[UNSEEN, second])


RNG = np.random.default_rng(0)
REST = RNG.normal(size=(40, 2))
STILL = np.column_stack([REST[:, 0], np.full(40, -7e5)])
PARTS = {
    "Experiment": [
        (lambda: experiment(simulate="simulate"), "simulate"),
        (lambda: experiment(observed="observed"), "observed"),
        (lambda: experiment(observed=np.full(30, np.nan), label="gone"), "gone: observed"),
        (lambda: experiment(noise=0.01), "noise"),
        (lambda: experiment(identity=3), "identity"),
        (lambda: experiment(windows=[3]), "windows"),
        (
            lambda: experiment(windows=[criticism.Window({"stroke": 1}, np.ones(19, bool))]),
            "stroke",
        ),
    ],
    "Proposal": [
        (lambda: proposal(simulate=3), "simulate"),
        (lambda: proposal(noise=3), "noise"),
        (lambda: proposal(shape=3), "shape"),
        (lambda: proposal(shape=(0,)), "shape"),
        (lambda: proposal(cost=-1.0), "cost"),
    ],
    "Extension": [
        (lambda: criticism.Extension("flat"), "prior"),
        (lambda: criticism.Extension(POSITIVE, "0"), "neutral"),
        (lambda: criticism.Extension(POSITIVE, -0.1), "neutral"),
        (lambda: criticism.Extension(dist.Normal(0.0, 1.0), np.inf), "neutral"),
        (lambda: criticism.Extension(POSITIVE, unit=3), "unit"),
    ],
    "Plan": [
        (lambda: criticism.Plan(base=-1), "base"),
        (lambda: criticism.Plan(extension=1), "extension"),
        (lambda: criticism.Plan(most=None), "most"),
    ],
    "KnownNoise": [
        (lambda: criticism.KnownNoise("x"), "sd must"),
        (lambda: criticism.KnownNoise(np.array([0.1, -0.1])), "sd must"),
        (lambda: criticism.KnownNoise(np.nan), "sd must"),
    ],
    "rest_noise": [
        (lambda: criticism.rest_noise([REST[:, 0]]), "rests"),
        (lambda: criticism.rest_noise([np.where(REST == REST[3], np.nan, REST)]), "rests"),
        (lambda: criticism.rest_noise([REST[:8, :1]]), "of 8 needed"),
        (lambda: criticism.rest_noise([REST[:9, :1]], trend=1), "of 8 needed"),
        (lambda: criticism.rest_noise([np.zeros((40, 2))]), "channel 0"),
        (lambda: criticism.rest_noise([STILL, STILL[:9]], trend=1), "channel 1"),
    ],
    "CleanData": [
        (lambda: clean(np.full((9, 1), np.nan)), "residual"),
        (lambda: clean(np.where(np.arange(9)[:, None] == 3, np.inf, 1.0)), "residual"),
        (lambda: clean(np.ones(9)), "residual"),
        (lambda: clean(noise=0.05), "noise"),
        (lambda: clean(same=3), "same"),
        (lambda: clean(regime_distance=np.nan), "regime_distance"),
    ],
    "learned_model_error": [
        (lambda: criticism.learned_model_error([]), "clean"),
        (lambda: criticism.learned_model_error([3]), "clean"),
        (lambda: criticism.learned_model_error([], 3), "known"),
        (
            lambda: criticism.learned_model_error(
                [clean()], criticism.learned_model_error([clean()])
            ),
            "known",
        ),
        (lambda: criticism.learned_model_error([clean(), clean(np.ones((9, 2)))]), "clean"),
        (lambda: criticism.learned_model_error([clean(), clean(np.ones((8, 1)))]), "clean"),
    ],
    "model_error": [
        (lambda: criticism.model_error(-1.0, 3.0), "size"),
        (lambda: criticism.model_error(1.0, 0.0), "correlation"),
        (lambda: criticism.model_error(1.0, [0.5, 0.2]), "correlation"),
        (lambda: criticism.model_error(1.0, 3.0, 0.0), "freedom"),
    ],
}


def refused(make, named):
    try:
        make()
    except ValueError as error:
        return bool(re.search(rf"\b{named}\b", str(error)))
    return False


@pytest.mark.parametrize("part", PARTS)
def test_its_parts_are_refused(part):
    assert [named for make, named in PARTS[part] if not refused(make, named)] == []


def test_what_is_just_allowed_is_not_refused():
    assert criticism.rest_noise([REST[:9, :1]]).samples == 9
    assert criticism.rest_noise([REST[:5]]).samples == 10
    assert abs(criticism.rest_noise([0.3 + 1e-6 * REST]).sd.mean() / 1e-6 - 1.0) < 0.3
    unlike = [clean(same=False), clean(np.ones((8, 1)))]
    assert criticism.learned_model_error(unlike).freedom == 2.0
    assert criticism.Extension(POSITIVE, 0.0).neutral == 0.0


def test_noise_of_samples_is_refused_for_a_summary_of_them():
    with pytest.raises(ValueError, match="summary"):
        inference.Bolfi(GOOD["prior"], OBSERVED, summary=lambda y: y[:7], noise=NOISE)
