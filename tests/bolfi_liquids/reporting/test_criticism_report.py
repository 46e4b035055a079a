"""What is shown and said of a criticism, from one that was made by hand."""

import io

import numpy as np
import pytest
from rich.console import Console

from bolfi_liquids.cli.tables import print_criticism
from bolfi_liquids.reporting import criticism_sentences as narrative
from bolfi_liquids.reporting.criticism_chapter import criticism_chapter

EFFECTS = ["camera_delay", "gripper_scale", "stick_mass"]
TIED = {
    "verdict": "tie",
    "effects": ["camera_delay", "gripper_scale"],
    "accepted": [],
    "coefficient": {},
    "suggestions": [
        {"experiment": "four circles", "between": ["camera_delay", "gripper_scale"], "snr": 1.0},
        {"experiment": "the star", "between": ["camera_delay", "gripper_scale"], "snr": 5.5},
    ],
}
UNKNOWN = {"verdict": "unknown", "effects": [], "accepted": [], "coefficient": {}}
REFUTED = {**UNKNOWN, "refuted": ["camera_delay"]}
NONE = {**UNKNOWN, "verdict": "none", "p_value": 0.4, "where": []}
CALIBRATED = {"parameters": {"viscosity": {"q05": 0.8, "q50": 1.0, "q95": 1.2}}}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "differ (p = 0.002): the missing effect is camera delay."),
        (TIED, "the missing effect is camera delay or gripper scale, and these data cannot"),
        (UNKNOWN, "no known effect explains it: what is missing is not known."),
        (NONE, "agree (p = 0.4): nothing is known to be missing."),
        ({"held_out": 0}, "the missing effect may be camera delay; no data held out confirm it."),
        ({"effects": EFFECTS}, "effects are camera delay, gripper scale and stick mass."),
    ],
)
def test_verdict_in_a_sentence(criticism_section, changes, said):
    assert said in narrative.verdict_sentence({**criticism_section, **changes})


def test_chapter_of_an_effect_that_was_named(criticism_section, made):
    chapter = criticism_chapter(criticism_section, made(held=True), CALIBRATED)
    assert "0.04 s and 0.06 s (90 %), median 0.05 s; 0 s would be no" in chapter["results"][1]
    assert "viscosity is 0.1 Pa s (90 %: 0.08 to 0.12) instead of 1 Pa s" in chapter["results"][2]
    assert "2 clean recordings" in chapter["caution"]
    assert "by 1.25° RMS, and with camera delay by 0.31°" in chapter["gap_sentence"]
    assert "1.50° before and 0.42° after" in chapter["gap_sentence"]
    assert "in stroke 1, xz plane, 1.0 to 2.0 s (1-first.nc): 2.50°" in chapter["where_sentence"]
    assert "at 0 to 3 cm/s (2-second.nc)" in chapter["where_sentence"]
    assert chapter["held_sentence"] == "On the recordings held out, camera delay holds."
    assert chapter["unseen_sentence"].startswith("At its typical size, stick mass has")
    assert "32 samples" in chapter["noise_sentence"]
    degrees = [f"{np.degrees(value):.2f}" for value in (0.03, 0.01, 0.008, 0.012)]
    assert chapter["held_rows"] == [["camera delay", "third.nc", *degrees, "0.4", "33.3", "yes"]]
    first = ["camera delay", "0.07 s", "14.0", "stick mass (-0.90)", "286.0", "0.8", "0.05 s"]
    assert chapter["sources"][0]["rows"][0] == [*first, "named"]
    assert "camera delay [s]" in chapter["coefficient"]
    assert "RMS of observed less expected [deg]" in chapter["held_out"]
    assert chapter["pours"] is None


def test_chapter_of_a_tie_says_what_to_record_next(criticism_section, made):
    gap = criticism_section["gap_deg"] | {"held_out_before": None, "held_out_after": None}
    chapter = criticism_chapter(
        {**criticism_section, **TIED, "gap_deg": gap}, made(after=False), CALIBRATED
    )
    assert len(chapter["results"]) == 1
    assert chapter["coefficient"] == chapter["superseded"] == chapter["held_out"] == ""
    assert "with the best explanation by 0.31°; the noise" in chapter["gap_sentence"]
    assert chapter["suggestion_sentence"] == (
        "To tell camera delay from gripper scale, record the star: a signal-to-noise ratio of 5.5"
        " is expected."
    )
    assert [row[0] for row in chapter["suggestions"]] == ["the star", "four circles"]
    assert "--held-out" in chapter["held_sentence"]


def test_next_experiment_that_would_not_help_is_not_recommended(criticism_section):
    weak = [one for one in TIED["suggestions"] if one["snr"] < narrative.SEEN]
    sentence = narrative.suggestion_sentence({**criticism_section, **TIED, "suggestions": weak})
    assert sentence.startswith("None of the experiments considered would tell camera delay from")


def test_chapter_of_an_explanation_that_held_out_data_refute(criticism_section, made):
    chapter = criticism_chapter(
        {**criticism_section, **REFUTED},
        made(after=False, held=False, status=["refuted by held-out data", "rejected", "rejected"]),
        CALIBRATED,
    )
    assert "camera delay explains these data, but data held out do not" in chapter["results"][0]
    assert "camera delay does not hold" in chapter["held_sentence"]


def test_chapter_of_a_model_that_agrees(criticism_section, made):
    gap = {**dict.fromkeys(criticism_section["gap_deg"]), "before": 0.3, "noise": 0.33}
    tree = made(after=False, status=["not needed"] * 3)
    chapter = criticism_chapter({**criticism_section, **NONE, "gap_deg": gap}, tree, CALIBRATED)
    assert chapter["gap_sentence"] == (
        "Beyond noise, recorded and expected inclination differ by 0.30° RMS; the noise of cameras"
        " and simulator is 0.33°."
    )
    assert "In no stroke" in chapter["where_sentence"]
    assert chapter["sources"][0]["rows"][1][4:6] == ["–", "–"]


def test_without_clean_recordings_the_reader_is_warned(criticism_section):
    warning = "Without clean recordings (--baseline) the residual may be the simulator's own."
    assert narrative.baseline_sentence({**criticism_section, "baseline": 0}) == warning
    assert warning not in narrative.baseline_sentence(criticism_section)


def test_what_was_given_as_clean_but_not_counted_is_named(criticism_section):
    section = {**criticism_section, "baseline_left_out": ["stir.nc"]}
    sentence = narrative.baseline_sentence(section)
    assert "2 clean recordings" in sentence
    assert "Not counted as clean, but looked at: stir.nc." in sentence


def test_that_few_effects_were_considered_is_said(criticism_section):
    assert narrative.considered_sentence(criticism_section) == ""
    few = {"settings": {"effects": ["camera_delay", "stick_mass"]}}
    assert narrative.considered_sentence({**criticism_section, "made_from": few}) == (
        "Only camera delay and stick mass could be named (--effects)."
    )


def test_what_was_accepted_on_request_is_not_said_to_be_found(criticism_section):
    asked = {**criticism_section, **NONE, "accepted": ["stick_mass"], "requested": ["stick_mass"]}
    assert narrative.accepted_sentence(asked).startswith("Stick mass joined the model on request")
    assert narrative.accepted_sentence(criticism_section) == ""
    worse = {**asked, "unsupported": ["stick_mass"]}
    assert "although these data do not bear out stick mass" in narrative.accepted_sentence(worse)


def test_effects_that_could_not_be_simulated_are_named(criticism_section):
    assert narrative.untested_sentence(criticism_section) == ""
    assert "Untested: stick mass." in narrative.untested_sentence(
        {**criticism_section, "untested": ["stick_mass"]}
    )


def test_pours_have_their_own_verdict(criticism_section, made):
    agree = {"p_value": 0.3, "verdict": "none", "effects": [], "refuted": [], "held_out": 0}
    unexplained = {**agree, "p_value": 0.01, "verdict": "unknown"}
    pours = {"before": 0.051, "after": None, **agree}
    section = {**criticism_section, "stirs": unexplained, "pours": pours}
    chapter = criticism_chapter(section, made(pours=True), CALIBRATED)
    assert "Simulated and real stirs differ (p = 0.01), and no known" in chapter["results"][1]
    assert chapter["pours"]["sentence"] == (
        "Simulated and real pours agree (p = 0.3): nothing is known to be missing. Spilled and"
        " retained fractions differ by 5.1 percentage points RMS."
    )
    for text in ("spilled", "retained", "expected [% of the liquid]", "observed [% of the liquid]"):
        assert f">{text}<" in chapter["pours"]["figure"]
    assert [source["name"] for source in chapter["sources"]] == ["stirs", "pours"]


def table(tree):
    return tree["stirs/effects"].to_dataset()


def printed(criticism_section, found):
    console = Console(width=80, file=io.StringIO())
    print_criticism(criticism_section, found, console)
    return console.file.getvalue()


@pytest.mark.parametrize("changes", [{}, TIED, UNKNOWN, NONE])
def test_the_command_line_fits_a_terminal(criticism_section, changes, made):
    text = printed(
        {**criticism_section, **changes, "baseline": 0}, table(made(status=["named"] * 3))
    )
    lines = text.splitlines()
    assert len(lines) <= 20
    assert max(map(len, lines)) <= 80
    assert narrative.NO_BASELINE in text


def test_the_command_line_says_what_was_found(criticism_section):
    text = printed(criticism_section, None)
    assert "the missing effect is camera delay" in text
    assert "camera delay: 0.05 s (90 %: 0.04 to 0.06)" in text
    assert "gap beyond noise: before 1.25 deg RMS, after 0.31 deg (noise: 0.33 deg)" in text
    assert "held out: before 1.50 deg RMS, after 0.42 deg (noise: 0.40 deg)" in text
    assert "surest in stroke 1, xz plane, 1.0 to 2.0 s (1-first.nc): 2.50 deg RMS" in text


def test_the_command_line_says_what_came_near_and_what_to_record(criticism_section, made):
    found = table(made(status=["rejected"] * 3))
    text = printed({**criticism_section, **TIED}, found)
    assert "explain most: camera delay (gain 286.0, p = 0.8); stick mass (gain 4.0" in text
    assert "gripper scale (gain" not in text
    assert "record the star" in text
    refuted = printed({**criticism_section, **REFUTED}, table(made()))
    assert "camera delay explains these data, but data held out" in " ".join(refuted.split())
