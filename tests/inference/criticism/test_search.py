"""Criticism from end to end: an oscillation that is late, shifted or drifting."""

from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.design import Rival, suggest
from bolfi_liquids.inference.criticism.search import REFIT_PASSES
from bolfi_liquids.inference.criticism.study import Study, phase_seeds
from bolfi_liquids.inference.simulations import Compute

from bolfi_liquids import inference

pytestmark = pytest.mark.slow

TIME = np.linspace(0.0, 6.0, 60)
PRIOR = inference.Prior({"frequency": dist.Uniform(2.0, 4.0)})
EXTENSIONS = {
    "offset": criticism.Extension(dist.Normal(0.0, 0.5)),
    "delay": criticism.Extension(dist.Normal(0.0, 0.1)),
    "phase": criticism.Extension(dist.Normal(0.0, 0.3)),
    "drift": criticism.Extension(dist.Normal(0.0, 0.1)),
    "broken": criticism.Extension(dist.HalfNormal(1.0)),
}
NOISE = criticism.AutoregressiveNoise(np.array([0.05]), np.array([0.6]))
PLAN = criticism.Plan(refits=2)
WINDOWS = (
    criticism.Window({"part": "first"}, TIME < 3.0),
    criticism.Window({"part": "second"}, TIME >= 3.0),
)


def oscillate(theta, seeds, speed=1.0):
    """A late oscillation and one of another phase are the same, but not at another speed."""
    if "broken" in theta:
        raise RuntimeError("never converges")
    of = {name: np.zeros((len(seeds), 1)) for name in EXTENSIONS}
    of |= {name: np.asarray(column)[:, None] for name, column in theta.items()}
    angle = speed * of["frequency"] * (TIME - of["delay"]) - of["phase"]
    mean = np.exp(-0.2 * TIME) * np.cos(angle) + of["offset"] + of["drift"] * TIME
    waves = np.cos(np.pi * np.arange(1, 6)[:, None] * TIME / 6.0)
    sizes = np.stack([np.random.default_rng(int(seed)).normal(size=5) for seed in seeds])
    return mean + 0.01 * sizes @ waves


def experiment(simulate=oscillate, seed=0, label="fitted", **truth):
    theta = {name: np.array([value]) for name, value in {"frequency": 3.0, **truth}.items()}
    at = SimpleNamespace(channel=np.zeros(60, int), sample=np.arange(60))
    noise = NOISE.draw(np.random.default_rng([seed, 1]), at, 1)[0]
    observed = simulate(theta, [10**6 + seed])[0] + noise
    return criticism.Experiment(simulate, observed, NOISE, label, label, WINDOWS)


@pytest.mark.parametrize(("drift", "verdict"), [(0.0, "none"), (0.3, "unknown")])
def test_without_effects_to_look_for_a_model_is_only_tested(drift, verdict):
    held_back = [held_out(drift=drift)]
    found = criticism.criticise(experiment(drift=drift), PRIOR, {}, held_out=held_back, plan=PLAN)
    assert found.verdict.kind == verdict
    assert not found.candidates and found.confusion.shape == (0, 0)
    assert "extension" in found.advice and "no extensions" in repr(found)


class Counted:
    """A simulator that counts its runs."""

    def __init__(self):
        self.runs = 0

    def __call__(self, theta, seeds):
        signals = oscillate(theta, seeds)
        self.runs += len(seeds)
        return signals


def held_out(**truth):
    return experiment(partial(oscillate, speed=1.3), 1, "other speed", **truth)


def same(a, b):
    """Bit for bit: fits, tests, posterior and all that was concluded."""
    assert a.verdict == b.verdict and a.accepted == b.accepted
    assert [c.names for c in a.candidates] == [c.names for c in b.candidates]
    for one, other in zip([a.base, *a.candidates], [b.base, *b.candidates], strict=True):
        assert one.check == other.check
        assert one.hypothesis.best == other.hypothesis.best
        np.testing.assert_array_equal(one.hypothesis.difference, other.hypothesis.difference)
        np.testing.assert_array_equal(one.hypothesis.spread, other.hypothesis.spread)
    np.testing.assert_array_equal(a.confusion, b.confusion)
    np.testing.assert_array_equal(a.posterior.weights, b.posterior.weights)
    for name, values in a.posterior.theta.items():
        np.testing.assert_array_equal(values, b.posterior.theta[name])


@pytest.fixture(scope="module")
def bank():
    with inference.SimulationBank() as bank:
        yield bank


@pytest.fixture(scope="module")
def criticised(bank):
    """(fitted, ...) -> Criticism, all runs in one bank."""

    def call(fitted, extensions=EXTENSIONS, **asked):
        how = {"plan": PLAN, "bank": bank, "batch": 64}
        return criticism.criticise(fitted, PRIOR, extensions, **how, **asked)

    return call


@pytest.fixture(scope="module")
def counted():
    return Counted()


@pytest.fixture(scope="module")
def drifting(criticised, counted):
    """What is said of drifting data."""
    fitted = replace(experiment(drift=0.06), simulate=counted)
    return criticised(fitted, held_out=[held_out(drift=0.06)])


def test_the_effect_that_acts_is_named_and_its_coefficient_found(drifting):
    assert drifting.verdict.kind == "effect"
    assert drifting.accepted == drifting.verdict.effects == ("drift",)
    assert drifting.holds(("drift",))
    interval = drifting.coefficients["drift"]
    assert interval.q05 < 0.06 < interval.q95 < 0.12
    (gap,) = drifting.gaps[("drift",)]
    assert gap.after < 0.5 * gap.before


def test_where_the_data_differ_is_said_before_and_after(drifting):
    assert drifting.before[1].p_value < 0.05 and drifting.before[1].z > 5.0
    assert min(found.p_value for found in drifting.after) > 0.05


class LostWithTheFirstEffect(Executor):
    """Runs what it is given, until an effect acts: then its workers are gone."""

    def submit(self, work, /):
        done = Future()
        (job,) = work.args[1]
        if EXTENSIONS.keys() & job.theta:
            done.set_exception(BrokenProcessPool("a worker was killed"))
        else:
            done.set_result(work())
        return done


def test_workers_that_are_lost_are_no_effect_that_fails():
    """Else a run that was interrupted would conclude that no effect can be tested."""
    how = {"plan": PLAN, "executor": LostWithTheFirstEffect()}
    with pytest.raises(RuntimeError, match="lost its workers"):
        criticism.criticise(experiment(drift=0.06), PRIOR, EXTENSIONS, **how)


def test_the_same_call_simulates_nothing_again_and_concludes_the_same(
    drifting, criticised, counted
):
    made = counted.runs
    # the base model, four effects and a refit at the least
    assert made > PLAN.start + PLAN.base + 4 * PLAN.extension
    fitted = replace(experiment(drift=0.06), simulate=counted)
    again = criticised(fitted, held_out=[held_out(drift=0.06)])
    assert counted.runs == made
    same(drifting, again)
    assert again.gaps == drifting.gaps and again.simulations == drifting.simulations


def test_other_held_out_data_change_no_fit(drifting, criticised):
    """Data that are as good, with other noise: a leak would change the last digits."""
    unseen = held_out(drift=0.06)
    noise = 0.01 * np.random.default_rng(5).normal(size=60)
    other = replace(unseen, observed=unseen.observed + noise)
    again = criticised(experiment(drift=0.06), held_out=[other])
    assert again.gaps != drifting.gaps
    same(drifting, again)


def test_held_out_data_that_the_explanation_fails_withdraw_it(drifting, criticised):
    """The other way round the drift makes all predictions worse."""
    again = criticised(experiment(drift=0.06), held_out=[held_out(drift=-0.06)])
    assert again.verdict.kind == "unknown"
    assert again.accepted == () and again.extended is None
    assert ("drift",) in again.refuted
    assert not again.singles["drift"].accepted
    for one, other in zip(drifting.candidates, again.candidates, strict=True):
        assert one.check == other.check and one.gain == other.gain


def test_held_out_data_that_cannot_be_simulated_are_refused_first(counted):
    """By a run, and three more in case that one failed by chance."""
    shorter = {"simulate": lambda theta, seeds: oscillate(theta, seeds)[:, :40], "label": "shorter"}
    elsewhere = replace(held_out(), identity="shorter", **shorter)
    before = counted.runs
    with pytest.raises(RuntimeError, match="shorter"):
        fitted = replace(experiment(drift=0.06), simulate=counted)
        criticism.criticise(fitted, PRIOR, EXTENSIONS, held_out=[elsewhere], plan=PLAN)
    assert counted.runs == before


@pytest.mark.parametrize("offset", [0.02, 0.03])
def test_an_experiment_is_suggested_wherever_explanations_are_left(criticised, offset):
    acting = {name: EXTENSIONS[name] for name in ("offset", "drift", "delay")}
    found = criticised(
        experiment(seed=2, drift=0.06, offset=offset), acting, proposals=[proposal(2.0)]
    )
    assert bool(found.suggestions) == (len(found.tied) > 1 or found.verdict.kind == "unknown")


def test_advice_asks_for_nothing_that_was_done(criticised, drifting):
    assert "held-out" not in drifting.advice
    assert "held-out" in criticised(experiment(drift=0.06)).advice


def test_a_user_may_accept_another_effect_than_is_named(criticised):
    found = criticised(experiment(drift=0.06), accept=["offset"])
    assert found.verdict.effects == ("drift",)
    assert found.accepted == ("offset",) == tuple(found.coefficients)
    assert found.extended is not None and found.extended.names == ("offset",)
    assert found.coefficients["offset"].q05 > 0.0


def test_what_a_user_accepts_changes_no_verdict(criticised, drifting):
    for names in (("offset", "drift"), ("drift", "offset")):
        held = [held_out(drift=0.06)]
        found = criticised(experiment(drift=0.06), held_out=held, accept=names)
        assert found.verdict == drifting.verdict
        assert found.accepted == names == tuple(found.coefficients)
        assert found.extended is not None and set(found.extended.names) == set(names)
        assert found.leading.refitted


def test_two_effects_are_named_together_and_one_that_adds_nothing_is_not_needed(criticised):
    acting = {name: EXTENSIONS[name] for name in ("offset", "drift", "delay")}
    found = criticised(experiment(drift=0.06, offset=0.3), acting)
    assert set(found.accepted) == {"offset", "drift"}
    assert found.verdict.effects == found.accepted and found.verdict.probability > 0.9
    assert found.probabilities["offset with delay"] < 0.01


def test_a_second_effect_is_weighed_where_one_passes_the_test(criticised):
    """Drift alone passes with little of it: then both are probable."""
    acting = {name: EXTENSIONS[name] for name in ("offset", "drift", "delay")}
    found = [
        criticised(experiment(seed=2, drift=0.06, offset=offset), acting)
        for offset in (0.0, 0.03, 0.06)
    ]
    none, little, much = (one.probabilities.get("offset with drift", 0.0) for one in found)
    assert none < 0.1 < little < 0.9 < much
    assert found[1].singles["drift"].passes


def test_effects_that_fail_together_are_accepted_as_they_are_alone(criticised):
    def apart(theta, seeds):
        return None if theta.keys() >= {"drift", "offset"} else oscillate(theta, seeds)

    fitted = replace(experiment(drift=0.06), simulate=apart, identity="apart")
    found = criticised(fitted, accept=["drift", "offset"])
    assert found.verdict.effects == ("drift",) and "offset" in repr(found)


def test_data_that_lack_nothing_are_let_alone(criticised):
    found = criticised(experiment(seed=2))
    assert found.verdict.kind == "none" and found.accepted == () and found.candidates == ()
    assert found.holds(("drift",))  # there are no held-out data
    assert f"  verdict: {found.verdict.reason}" in repr(found).splitlines()
    assert (
        found.posterior.interval("frequency").q05 < 3.0 < found.posterior.interval("frequency").q95
    )


def test_with_no_effect_that_can_be_simulated_nothing_is_known(criticised):
    found = criticised(experiment(drift=0.06), {"broken": EXTENSIONS["broken"]})
    assert found.verdict.kind == "unknown" and found.candidates == ()
    assert found.confusion.shape == (0, 0)


ODD = {
    "silent": lambda signals, seeds: None,
    "short": lambda signals, seeds: signals[:, :59],
    "seldom": lambda signals, seeds: np.where(np.isin(seeds, SELDOM)[:, None], signals, np.nan),
}
SELDOM = phase_seeds(0, "effects 0", PLAN.extension)[:1]


def oddly(theta, seeds):
    """Effects that do nothing, and of which few or no runs return a signal."""
    known = {name: theta[name] for name in theta.keys() & {"frequency", *EXTENSIONS}}
    signals = oscillate(known, seeds)
    for name in theta.keys() & ODD.keys():
        signals = ODD[name](signals, seeds)
    return signals


def test_effects_whose_runs_fail_are_untested_and_say_why(criticised):
    """They stop nothing. One that the simulator does not read is named, too."""
    fitted = replace(experiment(drift=0.06), simulate=oddly)
    half = criticism.Extension(dist.HalfNormal(1.0))
    odd = dict.fromkeys((*ODD, "unread"), half) | {"broken": half, "drift": EXTENSIONS["drift"]}
    found = criticised(fitted, odd)
    assert found.verdict.effects == ("drift",) == found.accepted
    assert list(found.untested) == [*ODD, "broken"] and list(found.singles) == ["unread", "drift"]
    assert "never converges" in found.untested["broken"] and "never converges" in repr(found)
    assert found.base.inert == ("unread",) and "unread" in repr(found)
    with pytest.raises(RuntimeError, match="silent cannot be accepted"):
        criticised(fitted, odd, accept=["silent"])


def test_an_effect_that_fails_where_it_would_be_refitted_is_untested_and_stops_nothing(criticised):
    refits = [phase_seeds(0, f"refit {k}", PLAN.refit) for k in range(REFIT_PASSES)]

    def fragile(theta, seeds):
        if "drift" in theta and np.isin(seeds, refits).any():
            return None
        return oscillate(theta, seeds)

    fitted = replace(experiment(drift=0.06), simulate=fragile, identity="fragile")
    found = criticised(fitted, {name: EXTENSIONS[name] for name in ("offset", "drift")})
    assert "refitted" in found.untested["drift"] and not found.singles["drift"].refitted
    assert "drift" not in found.accepted


def test_an_explanation_that_cannot_be_simulated_for_held_out_data_is_not_borne_out(criticised):
    def partly(theta, seeds):
        if "drift" in theta:
            raise ArithmeticError("beyond the table")
        return oscillate(theta, seeds, speed=1.3)

    unseen = replace(held_out(drift=0.06), simulate=partly, identity="partly")
    found = criticised(experiment(drift=0.06), held_out=[unseen])
    assert found.accepted == ()
    assert "held out" in found.untested["drift"] and "beyond the table" in found.untested["drift"]
    assert not found.singles["drift"].held and ("drift",) not in found.gaps


# Which experiment next?


def proposal(speed):
    return criticism.Proposal(
        partial(oscillate, speed=speed), NOISE, (60,), f"speed {speed}", f"speed {speed}"
    )


def test_effects_that_look_alike_are_tied_and_the_experiment_that_separates_them_comes_first(
    criticised,
):
    found = criticised(experiment(delay=0.15), proposals=[proposal(1.0), proposal(2.0)])
    assert found.verdict.kind == "tie"
    assert set(found.verdict.effects) == {"delay", "phase"}
    names = list(found.base.signatures)
    assert abs(found.confusion[names.index("delay"), names.index("phase")]) > 0.95
    assert [one.label for one in found.suggestions] == ["speed 2.0", "speed 1.0"]
    fast, again = found.suggestions
    assert fast.snr > 10.0 > 2.0 * again.snr
    assert 0.0 <= fast.error < 0.01 < again.error <= again.before <= 0.5


@pytest.fixture
def study():
    return Study(experiment(), PRIOR, EXTENSIONS, Compute(batch=4))


def test_runs_of_a_phase_differ_by_their_parameters_alone(study):
    at = {"frequency": np.full(2, 3.0)}
    base, late, broken = study.run_each(
        "together", [at, at | {"delay": np.full(2, 0.1)}, at | {"broken": np.ones(2)}]
    )
    assert len(broken) == 0 and "never converges" in broken.error
    np.testing.assert_array_equal(base.seeds, late.seeds)
    again = (
        base.signals - oscillate(at, [0, 0]) + oscillate(at | {"delay": np.full(2, 0.1)}, [0, 0])
    )
    np.testing.assert_allclose(late.signals, again, atol=1e-12)


RIVALS = {
    name: Rival({"frequency": np.full(3, 3.0), name: np.full(3, size)}, 1.0 / 3.0)
    for name, size in {"delay": 0.1, "phase": 0.3, "offset": 0.3}.items()
}


def test_an_experiment_is_as_good_as_the_pair_that_it_separates_least(study):
    """A delay and the phase that equals it at speed 1, against an offset. One that cannot be
    simulated is not suggested; a single explanation needs none."""
    dead = criticism.Proposal(lambda theta, seeds: None, NOISE, (60,), "dead", "dead")
    (fast, again), not_made = suggest(study, [dead, proposal(1.0), proposal(2.0)], RIVALS)
    assert list(not_made) == ["dead"] and "failed" in not_made["dead"]
    assert (fast.label, again.label) == ("speed 2.0", "speed 1.0")
    assert again.between == ("delay", "phase") and again.snr < 3.0 < fast.snr
    unlike = {name: RIVALS[name] for name in ("phase", "offset")}
    (alone,), _ = suggest(study, [proposal(1.0)], unlike)
    assert alone.between == ("phase", "offset") and alone.snr > 3.0
    assert suggest(study, [proposal(1.0)], {"delay": RIVALS["delay"]}) == ([], {})
