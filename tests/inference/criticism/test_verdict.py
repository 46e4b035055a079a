"""What is concluded, from explanations made by hand; and what a user may not ask for."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.verdict import conclude, near_best
from bolfi_liquids.inference.simulations import open_compute

from bolfi_liquids import inference

REJECTED = criticism.Check(0.001, 0.001, 0.2, {})
FITS = criticism.Check(0.4, 0.3, 0.5, {})
CONFIRMS = criticism.Gap("", 1.0, 0.3, 0.3, 0.2, 0.4, 0.5, 5.0)
REFUTES = CONFIRMS._replace(p_value=0.001)


def candidate(*names, gain, p_value=0.4, **more):
    """An explanation as `conclude` sees it."""
    check = criticism.Check(p_value, p_value, p_value, {})
    more = {"refitted": True, **more}
    return criticism.Candidate(SimpleNamespace(names=names), check, gain, **more)


def verdict(*candidates, base=REJECTED):
    found = conclude(base, candidates)
    return found.kind, found.effects


def test_a_model_that_fits_lacks_nothing():
    assert verdict(candidate("drag", gain=20.0), base=FITS) == ("none", ())
    assert "agree" in conclude(FITS, []).reason


def test_the_one_explanation_that_fits_is_named():
    drag, tilt = candidate("drag", gain=20.0), candidate("tilt", gain=18.0, p_value=0.001)
    assert verdict(drag, tilt) == ("effect", ("drag",))


def test_a_pair_is_one_explanation():
    assert verdict(candidate("drag", "tilt", gain=20.0)) == ("effect", ("drag", "tilt"))
    assert (
        "drag with tilt explains it"
        in conclude(REJECTED, [candidate("drag", "tilt", gain=9)]).reason
    )


@pytest.mark.parametrize(("behind", "kind"), [(3.9, "tie"), (4.1, "effect")])
def test_explanations_that_are_nearly_as_good_are_tied(behind, kind):
    drag, tilt = candidate("drag", gain=20.0), candidate("tilt", gain=20.0 - behind)
    assert verdict(tilt, drag) == (kind, ("drag", "tilt") if kind == "tie" else ("drag",))


def test_held_out_data_tell_explanations_apart():
    """Their evidence adds to the gain on the fitted data."""
    drag, tilt = candidate("drag", gain=20.0), candidate("tilt", gain=18.0)
    confirmed = [replace(one, gaps=(CONFIRMS,)) for one in (drag, tilt)]
    assert verdict(*confirmed) == ("tie", ("drag", "tilt"))
    better = replace(tilt, gaps=(CONFIRMS._replace(lpd_gain=12.0),))
    assert verdict(confirmed[0], better) == ("effect", ("tilt",))


def test_effects_of_tied_pairs_are_named_once():
    pairs = candidate("drag", "tilt", gain=20.0), candidate("drag", "delay", gain=19.0)
    assert verdict(*pairs) == ("tie", ("drag", "tilt", "delay"))


@pytest.mark.parametrize(
    "poor",
    [
        candidate("drag", gain=20.0, p_value=0.01),
        candidate("drag", gain=2.0),
        candidate("drag", gain=20.0, predicted=False),
        candidate("drag", gain=20.0, gaps=(REFUTES,)),
        candidate("drag", gain=20.0, refitted=False),
        candidate("drag", gain=20.0, needed=False),
    ],
    ids=["misfit", "gains nothing", "not predicted", "refuted", "not refitted", "not needed"],
)
def test_what_explains_nothing_is_not_named(poor):
    assert verdict(poor) == ("unknown", ())
    good = {"gaps": (), "predicted": True, "refitted": True, "needed": True}
    better = replace(poor, check=FITS, gain=20.0, **good)
    assert verdict(better) == ("effect", ("drag",))


def test_held_out_data_decide_only_where_there_is_something_to_explain():
    """An effect may be tried on data with which the base model agrees, if the user asks."""
    refuted = [candidate("drag", gain=20.0, predicted=False)]
    found = conclude(REJECTED, refuted)
    assert (found.kind, found.effects) == ("unknown", ())
    assert "drag" in found.reason and found.reason != conclude(REJECTED, []).reason
    agreeing = conclude(FITS, refuted)
    assert agreeing.kind == "none" and "differ" not in agreeing.reason


def test_the_best_and_what_fits_already_are_refitted():
    worst = candidate("worst", gain=-1.0, p_value=0.001)
    fits = candidate("fits", gain=1.0)
    others = [candidate(str(k), gain=10.0 - k, p_value=0.001) for k in range(4)]
    chosen = near_best([worst, *others, fits], 3)
    assert [one.names for one in chosen] == [("0",), ("1",), ("2",)]
    passing = replace(fits, gain=2.5)
    again = near_best([worst, *others, passing], 3)
    assert [one.names for one in again] == [("0",), ("fits",), ("1",)]
    assert near_best([worst], 3) == near_best(others, 0) == []
    behind = candidate("behind", gain=4.0, p_value=0.001)
    assert behind not in near_best([*others, behind], 9)


# What makes no sense is refused before anything is simulated.

PRIOR = inference.Prior({"rate": dist.Uniform(0.0, 1.0)})
DRAG = {"drag": criticism.Extension(dist.HalfNormal(1.0))}


def never(theta, seeds):
    raise AssertionError("simulated")


def experiment(observed, label="data"):
    return criticism.Experiment(never, observed, criticism.KnownNoise(0.1), label=label)


def refused(match, extensions=DRAG, **asked):
    with pytest.raises(ValueError, match=match):
        criticism.criticise(experiment(np.arange(20.0)), PRIOR, extensions, **asked)


def test_accepting_what_is_not_registered_is_refused():
    refused("cannot accept 'tilt', 'delay'; there are drag", accept=["tilt", "drag", "delay"])


def test_an_effect_named_like_a_parameter_is_refused():
    refused("extension 'rate' has the name of a parameter", {"rate": DRAG["drag"]})


@pytest.mark.parametrize("extensions", [{}, None, ["drag"], {"drag": 1.0}])
def test_what_is_no_registry_is_refused(extensions):
    refused("[Ee]xtension", extensions)


def test_held_out_data_that_are_fitted_are_refused():
    """Also as a copy, or with the same gaps."""
    observed = np.arange(20.0)
    refused("very data that are fitted", held_out=[experiment(observed.copy(), "other")])
    observed[3] = np.nan
    with pytest.raises(ValueError, match="very data that are fitted"):
        criticism.criticise(
            experiment(observed), PRIOR, DRAG, held_out=[experiment(observed.copy(), "other")]
        )


@pytest.mark.parametrize("neutral", [-0.1, np.inf, np.nan])
def test_a_neutral_coefficient_must_be_possible(neutral):
    with pytest.raises(ValueError, match="neutral must"):
        criticism.Extension(dist.HalfNormal(1.0), neutral)
    assert criticism.Extension(dist.HalfNormal(1.0), 0.0).neutral == 0.0


def test_experiments_without_data_and_windows_of_other_shape_are_refused():
    with pytest.raises(ValueError, match="other: observed must have a finite value"):
        experiment(np.full(20, np.nan), "other")
    window = criticism.Window({"stroke": 1}, np.ones(19, bool))
    with pytest.raises(ValueError, match=r"stroke.*\(19,\), expected \(20,\)"):
        criticism.Experiment(never, np.zeros(20), criticism.KnownNoise(0.1), windows=(window,))


def other(theta, seeds):
    raise AssertionError("simulated")


def test_experiments_that_the_bank_would_confuse_are_refused():
    """Of one label and without identities, the second would be given the first one's runs."""
    first = experiment(np.zeros(20), "recording")
    second = replace(first, simulate=other, observed=np.ones(20))
    refused("two experiments 'recording'.*identity", held_out=[first, second])
    noise = criticism.KnownNoise(0.1)
    proposals = [criticism.Proposal(one, noise, (20,)) for one in (never, other)]
    refused("two experiments 'experiment'.*identity", proposals=proposals)


@pytest.mark.parametrize("told_apart", [{"label": "b"}, {"identity": "b"}, {"simulate": never}])
def test_experiments_that_the_bank_tells_apart_or_may_confuse_are_not_refused(told_apart):
    """The simulator is reached."""
    first = experiment(np.zeros(20), "recording")
    second = replace(first, **{"simulate": other, "observed": np.ones(20), **told_apart})
    with pytest.raises(RuntimeError, match="AssertionError: simulated"):
        criticism.criticise(experiment(np.arange(20.0)), PRIOR, DRAG, held_out=[first, second])


# How simulations are made and kept.


class Client:
    """A Dask client, as far as the engine looks."""

    def __init__(self, pool):
        self.pool, self.asked = pool, []

    def get_executor(self, **options):
        self.asked.append(options)
        return self.pool

    def nthreads(self):
        return {}


def own_residual(executor):
    with open_compute(executor) as compute:
        criticism.own_residual(experiment(np.arange(20.0)), PRIOR, DRAG, compute)


def criticise(executor):
    criticism.criticise(experiment(np.arange(20.0)), PRIOR, DRAG, executor=executor)


@pytest.mark.parametrize("call", [criticise, own_residual])
def test_an_executor_is_what_it_is_for_a_fit(call):
    """A Dask client is asked once for an executor that repeats what failed; a fork is refused."""
    with ThreadPoolExecutor(1) as pool:
        client = Client(pool)
        with pytest.raises(RuntimeError, match="AssertionError: simulated"):
            call(client)
    assert client.asked == [{"pure": False}]
    forking = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(1, mp_context=forking) as pool:
        with pytest.raises(ValueError, match="fork"):
            call(pool)
