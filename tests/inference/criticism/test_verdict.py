"""What is concluded, from explanations and gaps made by hand."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.held_out import holds
from bolfi_liquids.inference.criticism.verdict import conclude, near_best

REJECTED = criticism.Check(0.001, 0.001, 0.2, {})
FITS = criticism.Check(0.4, 0.3, 0.5, {})
CONFIRMS = criticism.Gap("", 1.0, 0.3, 0.3, 0.2, 0.4, 0.5, 5.0)
REFUTES = CONFIRMS._replace(p_value=0.001)

BEHIND = {("drag",): 0.0, ("tilt",): 3.9, ("delay",): 4.1}  # in log likelihood


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


def test_the_one_explanation_that_fits_is_named_also_a_pair():
    drag, tilt = candidate("drag", gain=20.0), candidate("tilt", gain=18.0, p_value=0.001)
    assert verdict(drag, tilt) == ("effect", ("drag",))
    assert verdict(candidate("drag", "tilt", gain=20.0)) == ("effect", ("drag", "tilt"))


def test_explanations_that_are_nearly_as_good_are_tied():
    drag, near, far = (candidate(*one, gain=20.0 - behind) for one, behind in BEHIND.items())
    assert verdict(near, drag) == ("tie", ("drag", "tilt"))
    assert verdict(far, drag) == ("effect", ("drag",))


def test_held_out_data_tell_explanations_apart():
    """Their evidence adds to the gain on the fitted data."""
    drag, tilt = candidate("drag", gain=20.0), candidate("tilt", gain=18.0)
    confirmed = [replace(one, gaps=(CONFIRMS,)) for one in (drag, tilt)]
    assert verdict(*confirmed) == ("tie", ("drag", "tilt"))
    better = replace(tilt, gaps=(CONFIRMS._replace(lpd_gain=12.0),))
    assert verdict(confirmed[0], better) == ("effect", ("tilt",))


@pytest.mark.parametrize(
    "poor",
    [
        candidate("drag", gain=20.0, p_value=0.01),
        candidate("drag", gain=2.0),
        candidate("drag", gain=20.0, unpredicted="it raised"),
        candidate("drag", gain=20.0, gaps=(REFUTES,)),
        candidate("drag", gain=20.0, refitted=False),
        candidate("drag", gain=20.0, needed=False),
    ],
    ids=["misfit", "gains nothing", "not predicted", "refuted", "not refitted", "not needed"],
)
def test_what_explains_nothing_is_not_named(poor):
    assert verdict(poor) == ("unknown", ())
    good = {"gaps": (), "unpredicted": "", "refitted": True, "needed": True}
    better = replace(poor, check=FITS, gain=20.0, **good)
    assert verdict(better) == ("effect", ("drag",))


def test_held_out_data_decide_only_where_there_is_something_to_explain():
    """An effect may be tried on data with which the base model agrees, if the user asks."""
    refuted = [candidate("drag", gain=20.0, unpredicted="it raised")]
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


def test_gains_of_several_recordings_add_up_and_each_may_veto():
    def of(gain, p_value=0.5):
        return criticism.Gap("", 1.0, 0.5, 0.3, 0.2, 0.4, p_value, gain)

    assert not holds([of(2.0)])
    assert holds([of(2.0), of(2.0)]) and holds([])
    assert not holds([of(20.0), of(20.0, p_value=0.001)])


def test_most_of_a_gap_must_go_unless_it_may_be_noise():
    """Beyond noise of .3 and a model error of .2, in quadrature; .4 of noise is rare."""
    small = criticism.Gap("", 0.45, 0.39, 0.3, 0.2, 0.4, 0.5, 20.0)
    assert small.unexplained[1] > 0.5 * small.unexplained[0]
    assert holds([small])
    large = [criticism.Gap("", 1.0, after, 0.3, 0.2, 0.4, 0.5, 20.0) for after in (0.55, 0.6)]
    assert [one.unexplained[1] / one.unexplained[0] < 0.5 for one in large] == [True, False]
    assert [holds([one]) for one in large] == [True, False]
    # a recording that shows nothing of it takes nothing away
    indifferent = criticism.Gap("", 0.45, 0.45, 0.3, 0.2, 0.4, 0.5, 0.0)
    assert holds([large[0]._replace(after=0.4), indifferent]) and not holds([indifferent])
