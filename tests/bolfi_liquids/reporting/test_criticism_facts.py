"""What page and terminal say of a criticism, from one made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from bolfi_liquids.inference.criticism.verdict_kind import VerdictKind

import bolfi_liquids as bl
from bolfi_liquids.calibration.summary import ParameterSummary
from bolfi_liquids.cli.printed import print_findings
from bolfi_liquids.criticism.criticism_file import EffectStatus
from bolfi_liquids.criticism.summary import PourVerdict, SourceVerdict, SuggestedExperiment
from bolfi_liquids.reporting.facts import DETECTABLE_SNR, criticism_facts
from bolfi_liquids.reporting.prose import prose
from bolfi_liquids.reporting.report import figures_of
from bolfi_liquids.reporting.warnings import Results

EFFECTS = ("camera_delay", "gripper_scale", "stick_mass")
CIRCLES = SuggestedExperiment("four circles", EFFECTS[:2], 1.0)
STAR = SuggestedExperiment("the star", EFFECTS[:2], 5.5)
TIED = {
    "verdict": VerdictKind.TIE,
    "effects": EFFECTS[:2],
    "accepted": (),
    "coefficient": {},
    "suggestions": (CIRCLES, STAR),
}
UNKNOWN = {"verdict": VerdictKind.UNKNOWN, "effects": (), "accepted": (), "coefficient": {}}
REFUTED = {**UNKNOWN, "refuted": ("camera_delay",)}
AGREES = {**UNKNOWN, "verdict": VerdictKind.AGREEMENT, "p_value": 0.4, "where": ()}
LIQUID = {"viscosity": ParameterSummary(mean=1.0, sd=0.1, q05=0.8, q50=1.0, q95=1.2)}


@pytest.fixture
def criticise(calibration, criticism_summary, made):
    """Makes a criticism with other numbers, or of another tree."""
    base = replace(calibration, summary=replace(calibration.summary, parameters=LIQUID))

    def criticised(tree=None, **changes):
        summary = replace(criticism_summary, **changes)
        return bl.Criticism(base, made(held=True) if tree is None else tree, summary)

    return criticised


@pytest.fixture
def said(criticise):
    """Paragraphs of a part of what is said of a criticism with other numbers."""

    def of(part, tree=None, **changes):
        return prose(part, {"criticism": criticism_facts(criticise(tree, **changes))})

    return of


@pytest.mark.parametrize(
    ("changes", "words", "others"),
    [
        ({}, ["differ", "0.002", "camera delay"], ["may be"]),
        ({"held_out": 0}, ["differ", "may be camera delay"], []),
        ({"effects": EFFECTS}, ["camera delay, gripper scale and stick mass"], []),
        (TIED, ["camera delay or gripper scale", "cannot distinguish"], []),
        (UNKNOWN, ["differ", "No known effect"], ["camera delay"]),
        (REFUTED, ["Camera delay", "contradict"], ["No known effect"]),
        (AGREES, ["agree", "0.4"], ["differ"]),
    ],
)
def test_each_verdict_is_said(said, changes, words, others):
    (paragraph,) = said("verdict", **changes)
    assert all(word in paragraph for word in words)
    assert not any(word in paragraph for word in others)


def test_an_effect_that_was_named_has_its_size_and_changes_the_liquid(said):
    coefficient, refit = said("criticism")
    assert "0.04 s and 0.06 s" in coefficient and "0 s there is no effect" in coefficient
    assert "viscosity is 0.1 Pa s" in refit and "instead of 1 Pa s (90 %: 0.8 to 1.2)" in refit
    (gap,) = said("gap")
    assert all(f"{number}°" in gap for number in ("1.25", "0.31", "1.50", "0.42", "0.33", "0.20"))


def test_tables_hold_each_number_in_its_unit(criticise):
    facts = criticism_facts(criticise())
    first = facts["effects"]["stirs"][0]
    expected = ["camera delay", "0.07 s", "14.0", "stick mass (-0.90)", "286.0", "0.8", "0.05 s"]
    assert list(first.values()) == [*expected, "named"]
    degrees = [f"{np.degrees(value):.2f}°" for value in (0.03, 0.01, 0.008, 0.012)]
    (held,) = facts["held_out"]
    assert list(held.values()) == ["camera delay", "third.nc", *degrees, "0.4", "33.3", True]
    assert facts["holds"] == {"camera delay": True}
    assert facts["noise"]["samples"] == 32 and facts["pours"] is None


def test_figures_of_an_effect_that_was_named(criticise):
    criticism = criticise()
    drawn = figures_of(Results(criticism.base, criticism, None))
    assert "camera delay [s]" in drawn["coefficient"]
    assert "RMS of observed less expected [deg]" in drawn["held-out"]
    assert "pours" not in drawn


def test_a_tie_says_what_to_record_next(criticise, said, made):
    tree = made(after=False)
    facts = criticism_facts(criticise(tree, **TIED))
    assert [one["experiment"] for one in facts["suggestions"]] == ["the star", "four circles"]
    assert facts["holds"] == {} and facts["refit"] == []
    (recommended,) = said("next", tree, **TIED)
    assert "record the star" in recommended and "5.5" in recommended


def test_next_experiment_that_would_not_help_is_not_recommended(said):
    (paragraph,) = said("next", **(TIED | {"suggestions": (CIRCLES,)}))
    assert "None" in paragraph and "four circles" in paragraph and "1.0" in paragraph
    assert CIRCLES.snr < DETECTABLE_SNR < STAR.snr


def test_an_explanation_that_held_out_data_refute_does_not_hold(criticise, made):
    status = [EffectStatus.REFUTED, EffectStatus.STILL_DIFFERS, EffectStatus.GAINS_NOTHING]
    tree = made(after=False, held=False, status=status)
    facts = criticism_facts(criticise(tree, **REFUTED))
    assert facts["holds"] == {"camera delay": False}
    assert facts["all"]["refuted"] == ["camera delay"]


def test_a_model_that_agrees_has_one_gap_and_no_gains(criticise, criticism_summary, made):
    gap = replace(criticism_summary.gap, before=0.3, after=None)
    tree = made(after=False, status=[EffectStatus.NOT_NEEDED] * 3)
    facts = criticism_facts(criticise(tree, **AGREES, gap=gap))
    assert facts["effects"]["stirs"][1]["gain"] == facts["effects"]["stirs"][1]["p"] == "–"
    (paragraph,) = prose("gap", {"criticism": facts})
    assert "0.30°" in paragraph and "1.50°" not in paragraph
    (nowhere,) = prose("where", {"criticism": facts})
    assert "No single" in nowhere


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, [["2 clean"]]),
        ({"baseline": 0}, [["--baseline"]]),
        ({"baseline_left_out": ("stir.nc",)}, [["2 clean"], ["stir.nc"]]),
    ],
)
def test_what_the_verdict_owes_to_clean_recordings(said, changes, words):
    paragraphs = said("baseline", **changes)
    for paragraph, expected in zip(paragraphs, words, strict=True):
        assert all(word in paragraph for word in expected)


def test_windows_that_differ_are_listed_with_their_place(said):
    (paragraph,) = said("where")
    assert "stroke 1, xz plane, 1.0 to 2.0 s (1-first.nc): 2.50°" in paragraph
    assert "at 0 to 3 cm/s (2-second.nc): 1.50°" in paragraph


def test_that_few_effects_were_considered_is_said(said):
    few = {"settings": {"effects": ["camera_delay", "stick_mass"]}}
    first, *_ = said("criticism", made_from=few)
    assert "camera delay and stick mass" in first and "--effects" in first


def test_what_was_accepted_on_request_is_not_said_to_be_found(said):
    names = {"accepted": ("stick_mass",), "requested": ("stick_mass",)}
    names["parameters"] = LIQUID
    (asked, _) = said("criticism", **(AGREES | names))
    assert "Stick mass" in asked and "--accept" in asked and "not support" not in asked
    (worse, _) = said("criticism", **(AGREES | names), unsupported=("stick_mass",))
    assert "not support stick mass" in worse


def test_effects_that_could_act_undetected_or_were_not_simulated_are_named(said):
    (undetectable,) = said("undetectable")
    assert "stick mass" in undetectable and "camera delay" not in undetectable
    (_, untested) = said("undetectable", untested=("stick_mass",))
    assert untested.startswith("Untested: stick mass")


def test_pours_have_their_own_verdict(criticise, said, made):
    stirs = SourceVerdict(VerdictKind.UNKNOWN, (), 0.01, (), 0)
    pours = PourVerdict(VerdictKind.AGREEMENT, (), 0.3, (), 0, before=0.051, after=None)
    tree = made(pours=True)
    of_stirs, *_ = said("criticism", tree, stirs=stirs, pours=pours)
    assert "stirs" in of_stirs and "0.01" in of_stirs
    (of_pours,) = said("poured", tree, stirs=stirs, pours=pours)
    assert "pours agree" in of_pours and "5.1 percentage points" in of_pours
    (explained,) = said("poured", tree, stirs=stirs, pours=replace(pours, after=0.02))
    assert "5.1" in explained and "2.0" in explained
    criticism = criticise(tree, stirs=stirs, pours=pours)
    figures = figures_of(Results(criticism.base, criticism, None))
    for text in ("spilled", "retained", "expected [% of the liquid]", "observed [% of the liquid]"):
        assert f">{text}<" in figures["pours"]


@pytest.fixture
def printed(criticise, capsys, monkeypatch):
    """What a terminal of 80 columns shows of a criticism with other numbers."""
    monkeypatch.setenv("COLUMNS", "80")

    def of(tree=None, **changes):
        print_findings(criticise(tree, **changes))
        return capsys.readouterr().out

    return of


@pytest.mark.parametrize("changes", [{}, TIED, UNKNOWN, AGREES])
def test_the_command_line_fits_a_terminal(printed, made, changes):
    lines = printed(made(status=["named"] * 3), **changes, baseline=0).splitlines()
    assert len(lines) <= 20
    assert max(map(len, lines)) <= 80


def test_the_command_line_says_what_the_report_says(printed, said):
    text = " ".join(printed().split())
    for part in ("verdict", "baseline", "criticism", "gap", "where", "detectable"):
        assert all(paragraph in text for paragraph in said(part)), part


def test_the_command_line_says_what_was_not_there(printed, said, made):
    tree = made()
    tree["stirs/effects"]["snr"][:] = 0.1
    told = printed(tree, baseline=0)
    assert "(--baseline)" in told
    (paragraph,) = said("detectable", tree)
    assert paragraph in " ".join(told.split())


def test_an_effect_that_this_process_does_not_know_has_its_size_alone(said, made):
    own = {"my_effect": ParameterSummary(mean=2.0, sd=0.1, q05=1.8, q50=2.0, q95=2.2)}
    (coefficient, *_) = said("criticism", coefficient=own)
    assert "between 1.8 and 2.2" in coefficient and "no effect" not in coefficient


@pytest.mark.parametrize(("changes", "told"), [(TIED, True), (REFUTED, True), ({}, False)])
def test_effects_that_gain_are_named_where_nothing_else_is(said, made, changes, told):
    *_, last = said("detectable", made(status=["rejected: explains nothing"] * 3), **changes)
    assert ("camera delay (gain 286.0" in last and "stick mass (gain 4.0" in last) == told
    assert "gripper scale (gain" not in last
    unfitted = made(status=["not needed"] * 3)
    assert "gain" not in " ".join(said("detectable", unfitted, **changes))


def test_effects_that_these_data_could_reveal_are_listed_by_size(said, made):
    (paragraph,) = said("detectable")
    assert "camera delay (14), gripper scale (4)" in paragraph and "stick mass" not in paragraph
    tree = made()
    tree["stirs/effects"]["snr"].values[:] = 0.0
    (nothing,) = said("detectable", tree)
    assert "none" in nothing
