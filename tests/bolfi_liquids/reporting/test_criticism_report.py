"""What is shown of a criticism, and which sentences with which values, from one made by hand."""

import io
from dataclasses import replace

import numpy as np
import pytest
from bolfi_liquids.inference.criticism.verdict_kind import VerdictKind
from rich.console import Console

from bolfi_liquids.calibration.summary import ParameterSummary
from bolfi_liquids.cli.tables import print_criticism
from bolfi_liquids.criticism.criticism_file import EffectStatus
from bolfi_liquids.criticism.source_summary import PourVerdict, SourceVerdict
from bolfi_liquids.criticism.summary import SuggestedExperiment
from bolfi_liquids.reporting import criticism_sentences as sentences
from bolfi_liquids.reporting.criticism_chapter import criticism_chapter

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
NONE = {**UNKNOWN, "verdict": VerdictKind.AGREEMENT, "p_value": 0.4, "where": ()}
LIQUID = {"viscosity": ParameterSummary(mean=1.0, sd=0.1, q05=0.8, q50=1.0, q95=1.2)}


@pytest.fixture
def calibrated(calibration):
    return replace(calibration.summary, parameters=LIQUID)


def keys(found):
    return [one.key.removeprefix("criticism.") for one in found]


@pytest.mark.parametrize(
    ("changes", "key", "values"),
    [
        ({}, "effect", {"p_value": 0.002, "effects": ("camera_delay",)}),
        (TIED, "tie", {"effects": EFFECTS[:2]}),
        (UNKNOWN, "unexplained", {}),
        (REFUTED, "refuted", {"refuted": ("camera_delay",)}),
        (NONE, "agree", {"p_value": 0.4}),
        ({"held_out": 0}, "effect_unconfirmed", {"effects": ("camera_delay",)}),
        ({"effects": EFFECTS}, "effect", {"effects": EFFECTS}),
    ],
)
def test_each_verdict_has_its_sentence(criticism_summary, changes, key, values):
    sentence = sentences.verdict_sentence(replace(criticism_summary, **changes))
    assert sentence.key == f"criticism.{key}"
    assert values.items() <= sentence.values.items()
    for name in values.get("effects", ()):
        assert name.replace("_", " ") in str(sentence)


def test_chapter_of_an_effect_that_was_named(criticism_summary, made, calibrated):
    chapter = criticism_chapter(criticism_summary, made(held=True), calibrated)
    verdict, coefficient, refit = chapter["results"]
    assert keys([verdict, coefficient, refit]) == ["effect", "coefficient_of_effect", "refit"]
    delay = criticism_summary.coefficient["camera_delay"]
    assert coefficient.values["values"] == delay and coefficient.values["neutral"] == 0.0
    assert refit.values["now"] == criticism_summary.parameters["viscosity"]
    assert refit.values["before"] == LIQUID["viscosity"]
    assert chapter["baseline"][0].values == {"count": 2}
    fitted, held_out = chapter["gap"]
    assert (fitted.values["before"], fitted.values["after"]) == (1.25, 0.31)
    assert (held_out.values["before"], held_out.values["after"]) == (1.5, 0.42)
    assert chapter["where"].values == {"windows": criticism_summary.where, "more": 0}
    assert chapter["held"].values == {"holds": {"camera_delay": True}}
    assert chapter["doubtful_effects"][0].values["names"] == ("stick_mass",)
    assert chapter["noise"].values["noise"].samples == 32
    degrees = [f"{np.degrees(value):.2f}" for value in (0.03, 0.01, 0.008, 0.012)]
    assert chapter["held_rows"] == [["camera delay", "third.nc", *degrees, "0.4", "33.3", "yes"]]
    first = ["camera delay", "0.07 s", "14.0", "stick mass (-0.90)", "286.0", "0.8", "0.05 s"]
    assert chapter["sources"][0]["rows"][0] == [*first, "named"]
    assert "camera delay [s]" in chapter["coefficient"]
    assert "RMS of observed less expected [deg]" in chapter["held_out"]
    assert chapter["pours"] is None


@pytest.mark.slow
def test_chapter_of_a_tie_says_what_to_record_next(criticism_summary, made, calibrated):
    gap = replace(criticism_summary.gap, held_out_before=None, held_out_after=None)
    tied = replace(criticism_summary, **TIED, gap=gap)
    chapter = criticism_chapter(tied, made(after=False), calibrated)
    assert keys(chapter["results"]) == ["tie"]
    assert chapter["coefficient"] == chapter["held_out"] == "" and chapter["superseded"] == []
    (explained,) = chapter["gap"]
    assert explained.values["after"] == 0.31 and explained.values["accepted"] == ()
    assert chapter["suggestion"].key == "criticism.record_next"
    assert chapter["suggestion"].values == vars(STAR)
    assert [row[0] for row in chapter["suggestions"]] == ["the star", "four circles"]
    assert chapter["held"].key == "criticism.nothing_held_out"


def test_next_experiment_that_would_not_help_is_not_recommended(criticism_summary):
    weak = replace(criticism_summary, **(TIED | {"suggestions": (CIRCLES,)}))
    assert sentences.suggestion_sentence(weak).key == "criticism.no_experiment_helps"
    assert CIRCLES.snr < sentences.DETECTABLE_SNR < STAR.snr


@pytest.mark.slow
def test_chapter_of_an_explanation_that_held_out_data_refute(criticism_summary, made, calibrated):
    status = [EffectStatus.REFUTED, EffectStatus.REJECTED, EffectStatus.REJECTED]
    tree = made(after=False, held=False, status=status)
    chapter = criticism_chapter(replace(criticism_summary, **REFUTED), tree, calibrated)
    assert chapter["results"][0].values["refuted"] == ("camera_delay",)
    assert chapter["held"].values == {"holds": {"camera_delay": False}}


def test_chapter_of_a_model_that_agrees(criticism_summary, made, calibrated):
    gap = replace(criticism_summary.gap, before=0.3, after=None)
    tree = made(after=False, status=[EffectStatus.NOT_NEEDED] * 3)
    chapter = criticism_chapter(replace(criticism_summary, **NONE, gap=gap), tree, calibrated)
    assert keys(chapter["gap"]) == ["gap_before"]
    assert chapter["gap"][0].values == {"before": 0.3, "noise": 0.33, "usual": 0.2}
    assert chapter["where"].key == "criticism.nowhere"
    assert chapter["sources"][0]["rows"][1][4:6] == ["–", "–"]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, ["baseline"]),
        ({"baseline": 0}, ["no_baseline"]),
        ({"baseline_left_out": ("stir.nc",)}, ["baseline", "not_clean"]),
    ],
)
def test_what_the_verdict_owes_to_clean_recordings(criticism_summary, changes, expected):
    found = sentences.baseline_sentences(replace(criticism_summary, **changes))
    assert keys(found) == expected


def test_that_few_effects_were_considered_is_said(criticism_summary):
    assert sentences.considered_sentences(criticism_summary) == []
    few = {"settings": {"effects": ["camera_delay", "stick_mass"]}}
    (sentence,) = sentences.considered_sentences(replace(criticism_summary, made_from=few))
    assert sentence.values == {"names": ("camera_delay", "stick_mass")}


def test_what_was_accepted_on_request_is_not_said_to_be_found(criticism_summary):
    names = {"accepted": ("stick_mass",), "requested": ("stick_mass",)}
    asked = replace(criticism_summary, **(NONE | names))
    assert keys(sentences.requested_sentences(asked)) == ["requested"]
    assert sentences.requested_sentences(criticism_summary) == []
    (worse,) = sentences.requested_sentences(replace(asked, unsupported=("stick_mass",)))
    assert worse.key == "criticism.requested_unsupported"
    assert worse.values["unsupported"] == ("stick_mass",)


def test_effects_that_could_not_be_simulated_are_named(criticism_summary):
    assert sentences.untested_sentences(criticism_summary) == []
    (sentence,) = sentences.untested_sentences(replace(criticism_summary, untested=("stick_mass",)))
    assert sentence.values == {"names": ("stick_mass",)}


def test_pours_have_their_own_verdict(criticism_summary, made, calibrated):
    stirs = SourceVerdict(VerdictKind.UNKNOWN, (), 0.01, (), 0)
    pours = PourVerdict(VerdictKind.AGREEMENT, (), 0.3, (), 0, before=0.051, after=None)
    summary = replace(criticism_summary, stirs=stirs, pours=pours)
    chapter = criticism_chapter(summary, made(pours=True), calibrated)
    assert chapter["results"][1].values == {"data": "stirs", "p_value": 0.01}
    verdict, gap = chapter["pours"]["sentences"]
    assert verdict.values == {"data": "pours", "p_value": 0.3}
    assert gap.key == "criticism.pour_gap_before" and gap.values == {"before": 0.051}
    explained = sentences.pours_sentences(replace(pours, after=0.02))[1]
    assert explained.values == {"before": 0.051, "after": 0.02}
    for text in ("spilled", "retained", "expected [% of the liquid]", "observed [% of the liquid]"):
        assert f">{text}<" in chapter["pours"]["figure"]
    assert [source["name"] for source in chapter["sources"]] == ["stirs", "pours"]


def table(tree):
    return tree["stirs/effects"].to_dataset()


def printed(summary, found):
    console = Console(width=80, file=io.StringIO())
    print_criticism(summary, found, console)
    return console.file.getvalue()


@pytest.mark.parametrize("changes", [{}, TIED, UNKNOWN, NONE])
def test_the_command_line_fits_a_terminal(criticism_summary, changes, made):
    summary = replace(criticism_summary, **changes, baseline=0)
    lines = printed(summary, table(made(status=["named"] * 3))).splitlines()
    assert len(lines) <= 20
    assert max(map(len, lines)) <= 80


def test_the_command_line_has_the_sentences_of_the_report(criticism_summary, made):
    text = " ".join(printed(criticism_summary, table(made())).split())
    for sentence in (
        sentences.verdict_sentence(criticism_summary),
        *sentences.baseline_sentences(criticism_summary),
        *sentences.parameter_sentences(criticism_summary),
        *sentences.gap_sentences(criticism_summary.gap, criticism_summary.accepted),
        sentences.where_sentence(criticism_summary.where),
        sentences.detectable_sentence(table(made())),
    ):
        assert str(sentence) in text, sentence.key


def test_the_effects_that_come_nearest_are_those_that_gain(made):
    (sentence,) = sentences.largest_gains_sentences(table(made(status=["rejected"] * 3)))
    assert [(one["name"], one["gain"]) for one in sentence.values["effects"]] == [
        ("camera_delay", 286.0),
        ("stick_mass", 4.0),
    ]
    assert sentences.largest_gains_sentences(table(made(status=["not needed"] * 3))) == []


@pytest.mark.parametrize(("changes", "told"), [(TIED, True), (REFUTED, True), ({}, False)])
def test_the_command_line_names_them_where_nothing_is_named(criticism_summary, changes, told, made):
    found = table(made(status=["rejected"] * 3))
    text = " ".join(printed(replace(criticism_summary, **changes), found).split())
    assert (str(sentences.largest_gains_sentences(found)[0]) in text) == told


def test_effects_that_could_act_undetected_are_told_from_those_that_could_not(made):
    found = table(made())
    detectable = sentences.detectable_sentence(found)
    assert list(detectable.values["snr"].items()) == [
        ("camera_delay", 14.0),
        ("gripper_scale", 3.5),
    ]
    (undetectable,) = sentences.undetectable_sentences(found)
    assert undetectable.values["names"] == ("stick_mass",)
    nothing = found.assign(snr=0.0 * found["snr"])
    assert sentences.detectable_sentence(nothing).key == "criticism.nothing_detectable"
