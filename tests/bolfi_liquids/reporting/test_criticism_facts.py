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

SOURCES = ("stirs", "pours")
EFFECTS = ("camera_delay", "gripper_scale", "stick_mass")
CIRCLES = SuggestedExperiment("four circles", EFFECTS[:2], 1.0, 0.4, 0.3, 8.0)
STAR = SuggestedExperiment("the star", EFFECTS[:2], 5.5, 0.4, 0.02, 9.0, {"pattern": "star"})
TIED = {
    "verdict": VerdictKind.TIE,
    "effects": EFFECTS[:2],
    "accepted": (),
    "coefficient": {},
    "suggestions": (STAR, CIRCLES),
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


ASKED = AGREES | {"accepted": ("stick_mass",), "requested": ("stick_mass",), "parameters": LIQUID}
FEW = {"made_from": {"settings": {"effects": ["camera_delay", "stick_mass"]}}}
OWN = {"my_effect": ParameterSummary(mean=2.0, sd=0.1, q05=1.8, q50=2.0, q95=2.2)}


PARTS = [
    # part, numbers of the criticism, what is said, what is not
    ("verdict", {}, ["differ", "0.002", "camera delay"], ["may be"]),
    ("verdict", {"held_out": 0}, ["differ", "probably camera delay"], ["besides"]),
    ("verdict", {"perhaps": {"stick_mass": 0.2}}, ["Stick mass (20 %) may act besides"], []),
    ("verdict", TIED, ["camera delay or gripper scale", "cannot distinguish"], []),
    ("verdict", UNKNOWN, ["differ", "No known effect"], ["camera delay"]),
    ("verdict", REFUTED, ["Camera delay", "contradict"], ["No known effect"]),
    ("verdict", AGREES, ["agree", "0.4"], ["differ"]),
    ("criticism", {}, ["0.04 s and 0.06 s", "0 s there is no effect", "instead of 1 Pa s"], []),
    ("criticism", {"coefficient": OWN}, ["between 1.8 and 2.2"], ["there is no effect"]),
    ("criticism", FEW, ["camera delay and stick mass", "--effects"], []),
    ("criticism", ASKED, ["Stick mass", "--accept", "whatever"], ["not support"]),
    ("criticism", ASKED | {"unsupported": ("stick_mass",)}, ["not support stick mass"], []),
    ("gap", {}, ["1.25°", "0.31°", "1.50°", "0.42°", "0.33°", "0.20°"], []),
    ("noise", {}, ["0.20°", "32 samples", "40 %"], []),
    ("baseline", {"baseline": 0}, ["--baseline"], []),
    ("baseline", {"baseline_left_out": ("stir.nc",)}, ["2 clean", "stir.nc"], ["--baseline"]),
    ("where", {}, ["stroke 1, xz plane, 1.0 to 2.0 s (1-first.nc): 2.50°", "at 0 to 3 cm/s"], []),
    ("where", {"where": ()}, ["No single"], []),
    ("detectable", {}, ["would show", "camera delay (14), gripper scale (4)"], ["stick mass"]),
    ("undetectable", {"untested": ("gripper_scale",)}, ["stick mass", "Untested: gripper"], []),
    ("unwarned", {}, ["verdict or pour raised", "with camera delay", "count no longer"], []),
    ("unwarned", AGREES, ["posterior, verdict or pour raised a warning"], ["count no longer"]),
    ("next", TIED, ["record the star (9 s)", "5.5", "40 % to 2 %", "next_stir.toml"], []),
    ("next", TIED | {"suggestions": (CIRCLES,)}, ["None", "four circles", "1.0"], ["record"]),
]


def test_each_part_says_its_facts_and_no_others(said):
    wrong = []
    for part, changes, words, others in PARTS:
        whole = " ".join(said(part, **changes))
        missing = [word for word in words if word not in whole]
        if missing or any(other in whole for other in others):
            wrong.append((part, changes, missing, whole))
    assert not wrong


def test_tables_hold_each_number_in_its_unit(criticise):
    facts = criticism_facts(criticise())
    first = facts["effects"]["stirs"][0]
    expected = [
        "camera delay",
        "0 s",
        "0.07 s",
        "0.01 s",
        "0.02 s",
        "14.0",
        "stick mass (-0.90)",
        "286.0",
        "0.8",
    ]
    expected.append("0.05 s")
    assert list(first.values()) == [*expected, "named"]
    degrees = [f"{np.degrees(value):.2f}°" for value in (0.03, 0.01, 0.008, 0.012)]
    assert facts["effects"]["stirs"][1]["neutral"] == "1"  # distances beside it are of a scale
    (held,) = facts["held_out"]
    assert list(held.values()) == ["camera delay", "third.nc", *degrees, "0.4", "33.3", True]
    assert facts["holds"] == {"camera delay": True}
    assert facts["noise"]["samples"] == 32 and facts["pours"] is None


@pytest.mark.slow
def test_a_page_has_a_figure_of_everything_that_was_found(criticise, made):
    criticism = criticise(made(held=True, pours=True))
    drawn = figures_of(Results(criticism.base, criticism, None))
    of_sources = {f"{name}-{source}" for name in ("scores", "confusion") for source in SOURCES}
    always = {"inclination", "by-stroke", "posterior", "search", "residual", "strokes"}
    assert set(drawn) == always | of_sources | {"coefficient", "held-out", "pours"}
    for name, text in (
        ("coefficient", "camera delay [s]"),
        ("pours", "observed [% of the liquid]"),
    ):
        assert f">{text}<" in drawn[name]


def test_a_tie_ranks_what_to_record_next(criticise, made):
    facts = criticism_facts(criticise(made(after=False), **TIED))
    assert [one["experiment"] for one in facts["suggestions"]] == ["the star", "four circles"]
    assert facts["holds"] == {} and facts["refit"] == []
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


def test_pours_have_their_own_verdict(criticise, said, made):
    stirs = SourceVerdict(VerdictKind.UNKNOWN, (), {}, 0.01, 0.9, {}, {}, (), 0)
    pours = PourVerdict(
        VerdictKind.AGREEMENT,
        (),
        {},
        0.3,
        0.9,
        {},
        {"adhesion": 0.3},
        (),
        0,
        before=0.051,
        after=None,
    )
    tree = made(pours=True)
    of_stirs, *_ = said("criticism", tree, stirs=stirs, pours=pours)
    assert "stirs" in of_stirs and "0.01" in of_stirs
    (of_pours,) = said("poured", tree, stirs=stirs, pours=pours)
    assert "pours agree" in of_pours and "5.1 percentage points" in of_pours
    assert "adhesion 0.3" in of_pours  # what could hide
    (explained,) = said("poured", tree, stirs=stirs, pours=replace(pours, after=0.02))
    assert "5.1" in explained and "2.0" in explained


@pytest.fixture
def printed(criticise, capsys, monkeypatch):
    """What a terminal of 80 columns shows of a criticism with other numbers."""
    monkeypatch.setenv("COLUMNS", "80")

    def of(tree=None, **changes):
        print_findings(criticise(tree, **changes))
        return capsys.readouterr().out

    return of


def test_the_command_line_says_what_the_report_says_and_fits_a_terminal(printed, said, made):
    lines = printed(made(status=["named"] * 3), **TIED, baseline=0).splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    text = " ".join(printed().split())
    for part in ("verdict", "noise", "baseline", "criticism", "gap", "where", "detectable"):
        assert all(paragraph in text for paragraph in said(part)), part


@pytest.mark.parametrize(("changes", "told"), [(REFUTED, True), ({}, False)])
def test_effects_that_gain_are_named_where_nothing_else_is(said, made, changes, told):
    *_, last = said("detectable", made(status=["rejected: explains nothing"] * 3), **changes)
    assert ("camera delay (gain 286.0" in last and "stick mass (gain 4.0" in last) == told
    assert "gripper scale (gain" not in last
    unfitted = made(status=["not needed"] * 3)
    unfitted["stirs/effects"]["snr"].values[:] = 0.1
    (nothing,) = said("detectable", unfitted, **changes)
    assert "none" in nothing and "gain" not in nothing
