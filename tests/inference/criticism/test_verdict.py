"""What is concluded, from explanations and gaps made by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.held_out import holds
from bolfi_liquids.inference.criticism.verdict import (
    CREDIBLE,
    NONE,
    OTHER,
    PRIOR,
    conclude,
    near_best,
    probabilities,
)
from scipy.stats import chi2, norm

REJECTED = criticism.Check(0.001, 0.001, 0.2, {})
FITS = criticism.Check(0.4, 0.3, 0.5, {})
EFFECTS = 3


def gap(before, after, p_value, gain):
    """Beyond noise of .3 and a model error of .2."""
    return criticism.Gap("", before, after, 0.3, 0.2, 0.4, p_value, gain, gain)


CONFIRMS = gap(1.0, 0.3, 0.5, 5.0)
NO_GAP = gap(0.35, 0.3, 0.5, 20.0)
REFUTES = CONFIRMS._replace(p_value=0.001)


def candidate(*names, gain, p_value=0.4, **more):
    """An explanation as `conclude` sees it."""
    check = criticism.Check(p_value, p_value, p_value, {})
    more = {"refitted": True, **more}
    return criticism.Candidate(SimpleNamespace(names=names), check, gain, **more)


def concluded(*candidates, base=REJECTED):
    return conclude(base, candidates, probabilities(base, candidates, EFFECTS))


def verdict(*candidates, base=REJECTED):
    found = concluded(*candidates, base=base)
    return found.kind, found.effects


def test_a_model_that_fits_lacks_nothing():
    assert verdict(candidate("drag", gain=20.0), base=FITS) == ("none", ())


def test_the_one_explanation_that_fits_is_named_also_a_pair():
    drag, tilt = candidate("drag", gain=20.0), candidate("tilt", gain=15.0, p_value=0.001)
    assert verdict(drag, tilt) == ("effect", ("drag",))
    assert verdict(candidate("drag", "tilt", gain=20.0)) == ("effect", ("drag", "tilt"))


def test_explanations_are_named_until_the_right_one_is_among_them():
    """Of two, one is named alone where it is nine times as probable as the other."""
    drag = candidate("drag", gain=20.0)
    for behind in np.arange(0.25, 5.0, 0.25):
        tilt = candidate("tilt", gain=20.0 - behind)
        found = probabilities(REJECTED, [drag, tilt], EFFECTS)
        assert found["drag"] / found["tilt"] == pytest.approx(np.exp(behind))
        alone = verdict(drag, tilt) == ("effect", ("drag",))
        assert alone == (found["drag"] >= CREDIBLE)
        assert alone or verdict(tilt, drag) == ("tie", ("drag", "tilt"))


def test_held_out_data_tell_explanations_apart():
    """Their evidence adds to the gain on the fitted data."""
    drag, tilt = candidate("drag", gain=20.0), candidate("tilt", gain=18.0)
    confirmed = [replace(one, gaps=(CONFIRMS,)) for one in (drag, tilt)]
    assert verdict(*confirmed) == ("tie", ("drag", "tilt"))
    better = replace(tilt, gaps=(CONFIRMS._replace(evidence=12.0),))
    assert verdict(confirmed[0], better) == ("effect", ("tilt",))
    assert "probably" not in concluded(confirmed[0], better).reason
    assert "probably" in concluded(drag).reason  # nothing was held out


def test_nothing_is_named_alone_where_held_out_data_show_no_gap():
    """Whatever its probability, which stays what it is."""
    drag = candidate("drag", gain=30.0, gaps=(NO_GAP,))
    assert probabilities(REJECTED, [drag], EFFECTS)["drag"] > 0.99
    assert verdict(drag) == ("unknown", ())
    tilt = candidate("tilt", gain=29.0, gaps=(NO_GAP,))
    assert verdict(tilt, drag) == ("tie", ("drag", "tilt"))
    assert verdict(replace(drag, gaps=(CONFIRMS,))) == ("effect", ("drag",))


def test_no_other_is_named_in_the_place_of_a_probable_one_that_is_refuted():
    drag = candidate("drag", gain=20.0, gaps=(CONFIRMS,))
    tilt = candidate("tilt", gain=40.0, gaps=(CONFIRMS._replace(lpd_gain=2.0, evidence=2.0),))
    roll = candidate("roll", gain=15.0, gaps=(CONFIRMS,))
    assert verdict(drag, tilt) == ("unknown", ())
    assert verdict(drag, tilt, roll) == ("unknown", ())


@pytest.mark.parametrize(
    "poor",
    [
        candidate("drag", gain=20.0, p_value=0.005),
        candidate("drag", gain=20.0, unpredicted="it raised"),
        candidate("drag", gain=20.0, gaps=(REFUTES,)),
        candidate("drag", gain=20.0, gaps=(NO_GAP,)),
        candidate("drag", gain=20.0, refitted=False),
    ],
    ids=["misfit", "not predicted", "refuted", "no gap", "not refitted"],
)
def test_what_explains_nothing_is_not_named(poor):
    assert verdict(poor) == ("unknown", ())
    good = {"gaps": (), "unpredicted": "", "refitted": True}
    better = replace(poor, check=FITS, gain=20.0, **good)
    assert verdict(better) == ("effect", ("drag",))


def test_an_effect_that_gains_little_is_not_named():
    """A p-value that is small by chance is more probable than that."""
    chance = criticism.Check(0.04, 0.04, 0.04, {})
    weak = candidate("drag", gain=2.0, occam=-2.0)
    assert verdict(weak, base=chance) == ("none", ())


def test_a_second_effect_must_be_worth_its_prior():
    alone = candidate("drag", gain=20.0, occam=-2.0)
    pairs = [candidate("drag", "tilt", gain=20.0 + g, occam=-4.0) for g in (1.0, 12.0)]
    assert verdict(alone, pairs[0])[1] == ("drag",)
    assert verdict(alone, pairs[1])[1] == ("drag", "tilt")


def test_what_all_probable_explanations_have_in_common_is_named():
    """What is then not known is whether another acts, too."""
    alone = candidate("drag", gain=20.0)
    both = candidate("drag", "tilt", gain=20.5)
    found = probabilities(REJECTED, [alone, both], EFFECTS)
    assert CREDIBLE > found["drag"] > found["drag with tilt"] > 0.1
    told = concluded(alone, both)
    assert (told.kind, told.effects) == ("effect", ("drag",)) and "tilt" in told.reason
    assert told.probability == pytest.approx(found["drag"] + found["drag with tilt"])
    assert verdict(alone, replace(both, gain=23.0)) == ("effect", ("drag",))
    assert verdict(alone, replace(both, gain=26.0)) == ("effect", ("drag", "tilt"))
    assert verdict(replace(alone, refitted=False), replace(both, gain=23.0))[0] == "unknown"


def test_probabilities_are_those_of_bayes_rule():
    """One normal datum of variance 1 whose mean is 0, or N(0, 3^2) if an effect acts: the exact
    ratio of evidences, by its gain and the share of the prior that explains it (Laplace)."""
    datum, sd = 2.5, 3.0
    variance = 1.0 / (1.0 + sd**-2)
    gain = 0.5 * datum**2 * variance  # at the mode of the posterior, prior density included
    occam = 0.5 * np.log(variance) - np.log(sd)
    exact = norm.logpdf(datum, scale=np.hypot(1.0, sd)) - norm.logpdf(datum)
    assert gain + occam == pytest.approx(exact)
    found = probabilities(FITS, [candidate("drag", gain=gain, occam=occam)], EFFECTS)
    expected = np.exp(exact) * PRIOR.one / EFFECTS / PRIOR.none
    assert found["drag"] / found[NONE] == pytest.approx(expected)


def test_stated_probabilities_are_those_of_a_linear_world():
    """Data sets whose truth is drawn from the priors, in 24 directions of unit noise: nothing, one
    of three effects, or a change in any direction. Of the statements of a probability as many are
    right, within 4 standard errors."""
    rng, directions, sd, sets = np.random.default_rng(1), 24, 6.0, 4000
    shares = [PRIOR.none, *[PRIOR.one / EFFECTS] * EFFECTS, PRIOR.other]
    shares = np.array(shares) / np.sum(shares)
    names = [NONE, "a", "b", "c", OTHER]
    stated, right = [], []
    for truth in rng.choice(len(names), sets, p=shares):
        data = rng.normal(size=directions)
        if names[truth] == OTHER:
            data += 3.0 * sd * rng.normal(size=directions) / np.sqrt(directions)
        elif truth:
            data[truth - 1] += sd * rng.normal()
        squares = np.sum(data**2) - np.append(0.0, data[:EFFECTS] ** 2)
        freedom = directions - np.append(0.0, np.ones(EFFECTS))
        p = np.maximum(np.ceil(chi2.sf(squares, freedom) * 1000.0) / 1000.0, 0.003)
        share = 1.0 / (1.0 + sd**-2)
        gains = 0.5 * data[:EFFECTS] ** 2 * share
        occam = -0.5 * np.log(1.0 + sd**2)
        made = [
            candidate(name, gain=gain, occam=occam, p_value=of)
            for name, gain, of in zip(names[1:4], gains, p[1:], strict=True)
        ]
        found = probabilities(criticism.Check(p[0], p[0], p[0], {}), made, EFFECTS)
        best = max(found, key=found.__getitem__)
        stated.append(found[best])
        right.append(best == names[truth])
    stated, right = np.array(stated), np.array(right)
    for low, high in ((0.4, 0.7), (0.7, 0.9), (0.9, 0.97), (0.97, 1.0)):
        there = (stated >= low) & (stated <= high)
        error = np.sqrt(np.mean(stated[there] * (1.0 - stated[there])) / there.sum())
        assert abs(np.mean(right[there]) - stated[there].mean()) < 4.0 * error + 0.03, (low, high)


def test_held_out_data_decide_only_where_there_is_something_to_explain():
    """An effect may be tried on data with which the base model agrees, if the user asks."""
    refuted = candidate("drag", gain=20.0, unpredicted="it raised")
    found = concluded(refuted)
    assert (found.kind, found.effects) == ("unknown", ())
    assert "drag" in found.reason and found.reason != concluded().reason
    agreeing = concluded(refuted, base=FITS)
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
    # a first fit may be poor; a refit is not
    promising = replace(behind, promise=9.5, refitted=False)
    assert near_best([*others, promising], 2)[1] is promising
    refitted = replace(promising, refitted=True)
    assert refitted not in near_best([*others, refitted], 9)


def test_gains_of_several_recordings_add_up_and_each_may_veto():
    def of(gain, p_value=0.5):
        return gap(1.0, 0.5, p_value, gain)

    assert not holds([of(2.0)])
    assert holds([of(2.0), of(2.0)]) and holds([])
    assert not holds([of(20.0), of(20.0, p_value=0.001)])


def test_most_of_a_gap_must_go_unless_it_may_be_noise():
    """Beyond noise of .3 and a model error of .2, in quadrature; .4 of noise is rare."""
    small = gap(0.45, 0.39, 0.5, 20.0)
    assert small.unexplained[1] > 0.5 * small.unexplained[0]
    assert holds([small])
    large = [gap(1.0, after, 0.5, 20.0) for after in (0.55, 0.6)]
    assert [one.unexplained[1] / one.unexplained[0] < 0.5 for one in large] == [True, False]
    assert [holds([one]) for one in large] == [True, False]
    # a recording that shows nothing of it takes nothing away
    indifferent = gap(0.45, 0.45, 0.5, 0.0)
    assert holds([large[0]._replace(after=0.4), indifferent]) and not holds([indifferent])
