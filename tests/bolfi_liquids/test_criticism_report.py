"""What is shown and said of a criticism, from one that was made by hand."""

import io
import re
import shutil
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from xarray import Dataset, DataTree

import bolfi_liquids as bl
from bolfi_liquids import criticism_narrative as narrative
from bolfi_liquids.criticism_chapter import criticism_chapter
from bolfi_liquids.criticism_figures import residual_plot, stroke_plot
from bolfi_liquids.drawing import to_svg
from bolfi_liquids.effect_figures import coefficient_plot, confusion_plot, score_plot
from bolfi_liquids.results import write_tree
from bolfi_liquids.run_directory import CRITICISM
from bolfi_liquids.summary import write_section
from bolfi_liquids.tables import print_criticism

EFFECTS = ("camera_delay", "gripper_scale", "stick_mass")
FILES = ("1-first.nc", "2-second.nc")
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
NONE = {**UNKNOWN, "verdict": "none", "p_value": 0.4, "where": []}


def spread(q50):
    return {"mean": q50, "sd": 0.1 * q50, "q05": 0.8 * q50, "q50": q50, "q95": 1.2 * q50}


CALIBRATED = {"parameters": {"viscosity": spread(1.0)}}


@pytest.fixture
def section():
    """Of a criticism that names and accepts one effect."""
    window = {"channel": "xz", "recording": FILES[0], "stroke": 1, "start_s": 1.0, "stop_s": 2.0}
    speed = {"recording": FILES[1], "speed": "0 to 3 cm/s"}
    return {
        "verdict": "effect",
        "effects": ["camera_delay"],
        "accepted": ["camera_delay"],
        "accepted_by": "verdict",
        "reason": "",
        "p_value": 0.002,
        "where": [
            {**window, "rms_deg": 2.5, "p_value": 0.01},
            {**speed, "rms_deg": 1.5, "p_value": 0.02},
        ],
        "coefficient": {"camera_delay": spread(0.05)},
        "parameters": {"viscosity": spread(0.1), "camera_delay": spread(0.05)},
        "best": {"viscosity": 0.1, "camera_delay": 0.05},
        "n_simulations": 77,
        "gap_deg": {
            "before": 1.25,
            "after": 0.31,
            "held_out_before": 1.5,
            "held_out_after": 0.42,
            "noise": 0.33,
        },
        "pours": None,
        "suggestions": [],
        "untested": [],
        "baseline": 2,
        "noise": {"sd_deg": 0.2, "sd_uncertainty": 0.4, "correlation": 0.25, "samples": 32},
        "seconds": 8.0,
        "seed": 0,
        "version": bl.__version__,
    }


def windows(after):
    strokes = [
        (plane, name, number, float(number), number + 1.0, "")
        for name in FILES
        for number in (0, 1)
        for plane in ("xz", "yz")
    ]
    speeds = [("", name, -1, np.nan, np.nan, "0 to 3 cm/s") for name in FILES]
    rows = strokes + speeds
    keys = ("channel", "recording", "stroke", "start_s", "stop_s", "speed")
    columns = {key: ("window", list(values)) for key, values in zip(keys, zip(*rows), strict=True)}
    for when in ("before", "after") if after else ("before",):
        size = np.full(len(rows), 0.02)
        p_value = np.where(np.arange(len(rows)) == 2, 0.01, 0.5)  # stroke 1 of the first, in xz
        columns |= {f"{key}_{when}": ("window", size) for key in ("rms", "z")}
        columns[f"p_value_{when}"] = ("window", p_value)
    return Dataset(columns)


def effects(status):
    cosine = np.array([[1.0, 0.2, -0.9], [0.2, 1.0, 0.1], [-0.9, 0.1, 1.0]])
    fitted = status[0] != "not needed"
    columns = {
        "typical": [0.07, 1.07, 1.1],
        "snr": [14.0, 3.5, 0.4],
        "score": [11.0, -4.0, 1.0],
        "gain": [286.0, -20.0, 4.0] if fitted else [np.nan] * 3,
        "p_value": [0.8, 0.003, 0.002] if fitted else [np.nan] * 3,
        "coefficient": [0.05, 0.8, 1.4],
        "status": status,
    }
    names = list(EFFECTS)
    found = Dataset({k: ("effect", v) for k, v in columns.items()}, coords={"effect": names})
    coords = {"effect": names, "other": names}
    return found, Dataset({"cosine": (("effect", "other"), cosine)}, coords=coords)


def held_out(passes):
    at = ("explanation", "recording")
    sizes = {"before": 0.03, "after": 0.01, "noise": 0.008, "floor": 0.012, "lpd_gain": 33.3}
    columns = {key: (at, [[value]]) for key, value in sizes.items()}
    return Dataset(
        {**columns, "passes": (at, [[passes]])},
        coords={"explanation": ["camera_delay"], "recording": ["third.nc"]},
    )


def made(*, after=True, held=None, pours=False, status=("accepted", "rejected", "rejected")):
    """A tree as `criticise` writes it: two recordings of 2 s, and maybe four pours."""
    rng = np.random.default_rng(0)
    frames, each = ("frame", "plane"), 20
    coords = {
        "time": ("frame", np.tile(np.linspace(0.0, 2.0, each), 2)),
        "recording": ("frame", np.repeat([0, 1], each)),
        "plane": ["xz", "yz"],
    }
    names = ["observed"]
    for when in ("before", "after") if after else ("before",):
        names += [f"expected_{when}", f"sd_{when}"]
    angles = {name: (frames, rng.uniform(0.0, 0.05, (2 * each, 2))) for name in names}
    found, confusion = effects(list(status))
    draws = rng.normal(0.05, 0.005, (2, 100))
    groups = {
        "/posterior": Dataset({"camera_delay": (("chain", "draw"), draws)}),
        "/stirs/residual": Dataset(angles, coords=coords),
        "/stirs/where": windows(after),
        "/stirs/effects": found,
        "/stirs/confusion": confusion,
    }
    if held is not None:
        groups["/stirs/held_out"] = held_out(held)
    if pours:
        pour = {
            "angular_velocity": ("pour", np.linspace(0.5, 2.0, 4)),
            "distance": ("pour", np.full(4, 0.03)),
            "outcome": ["spilled", "retained"],
        }
        fractions = {name: (("outcome", "pour"), rng.uniform(0.0, 0.3, (2, 4))) for name in names}
        groups["/pours/residual"] = Dataset(fractions, coords=pour)
        groups["/pours/effects"], groups["/pours/confusion"] = found, confusion
    tree = DataTree.from_dict(groups)
    tree.attrs.update(
        version=bl.__version__,
        baseline=["clean.nc"],
        baseline_sha256=["abc123"],
        accepted=["camera_delay"],
        accepted_by="verdict",
    )
    return tree


def drawn(figure):
    """The texts of a figure."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", to_svg(figure, "test"))


def panel(figure, title):
    """The axes whose title ends so."""
    return [axes for axes in figure.axes if axes.get_title(loc="left").endswith(title)]


def test_residuals_are_drawn_in_degrees_with_the_sure_stroke_shaded():
    tree = made()
    figure = residual_plot(tree["stirs"])
    assert len(figure.axes) == 4
    first = panel(figure, "xz plane")[0]
    part = tree["stirs/residual"].to_dataset().isel(frame=slice(0, 20), plane=0)
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in first.get_lines()}
    for when, label in (("before", "before"), ("after", "with the missing effect")):
        left = np.degrees((part["observed"] - part[f"expected_{when}"]).to_numpy())
        np.testing.assert_allclose(lines[label], left)
    assert [text.get_text() for text in first.texts] == ["1"]
    for axes in figure.axes:
        if axes is not first:
            assert not axes.texts
    texts = drawn(figure)
    assert {"observed less expected [deg]", "time [s]", *FILES} <= set(texts)


def test_without_an_extended_model_only_what_was_before_is_drawn():
    tree = made(after=False)
    for plot in (residual_plot, stroke_plot):
        texts = drawn(plot(tree["stirs"]))
        assert "before" in texts
        assert "with the missing effect" not in texts


def test_strokes_are_bars_of_rms_in_degrees():
    figure = stroke_plot(made()["stirs"])
    assert len(figure.axes) == 6
    for axes in figure.axes:
        heights = [patch.get_height() for patch in axes.patches]
        np.testing.assert_allclose(heights, np.degrees(0.02))
    texts = drawn(figure)
    assert {"RMS [deg]", "stroke", "gripper's speed [cm/s]", "0 to 3"} <= set(texts)


def test_effects_are_sorted_by_what_they_gain():
    figure = score_plot(made()["stirs"])
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == ["camera delay", "stick mass", "gripper scale"]
    texts = drawn(figure)
    assert {"gain in log likelihood", "size of the score [sd]", "accepted", "rejected"} <= set(
        texts
    )


def test_effects_that_were_not_fitted_are_sorted_by_score():
    tree = made(status=["not needed"] * 3)
    figure = score_plot(tree["stirs"])
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == ["camera delay", "gripper scale", "stick mass"]
    assert [text for text in drawn(figure) if "not fitted" in text] == [" not fitted"] * 3


def test_likeness_has_no_sign():
    texts = drawn(confusion_plot(made()["stirs"]))
    assert texts.count("0.90") == 2
    assert texts.count("1.00") == 3
    assert "camera delay" in texts


def test_coefficient_is_drawn_in_its_unit_beside_no_effect():
    figure = coefficient_plot(made(), ["camera_delay"])
    texts = drawn(figure)
    assert {"camera delay [s]", "90 % interval", "no effect"} <= set(texts)
    (neutral,) = [line for line in figure.axes[0].get_lines() if line.get_label() == "no effect"]
    assert set(neutral.get_xdata()) == {0.0}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "differ (p = 0.002): the missing effect is camera delay."),
        (TIED, "the missing effect is camera delay or gripper scale, and these data cannot"),
        (UNKNOWN, "no known effect explains it: what is missing is not known."),
        (NONE, "agree (p = 0.4): nothing is known to be missing."),
        ({"effects": list(EFFECTS)}, "effects are camera delay, gripper scale and stick mass."),
    ],
)
def test_verdict_in_a_sentence(section, changes, said):
    assert said in narrative.verdict_sentence({**section, **changes})


def test_chapter_of_an_effect_that_was_named(section):
    chapter = criticism_chapter(section, made(held=True), CALIBRATED)
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
    assert chapter["held_rows"] == [["camera delay", "third.nc", *degrees, "33.3", "yes"]]
    first = ["camera delay", "0.07 s", "14.0", "stick mass (-0.90)", "286.0", "0.8", "0.05 s"]
    assert chapter["sources"][0]["rows"][0] == [*first, "accepted"]
    assert "camera delay [s]" in chapter["coefficient"]
    assert "RMS of observed less expected [deg]" in chapter["held_out"]
    assert chapter["pours"] is None


def test_chapter_of_a_tie_says_what_to_record_next(section):
    gap = section["gap_deg"] | {"held_out_before": None, "held_out_after": None}
    chapter = criticism_chapter({**section, **TIED, "gap_deg": gap}, made(after=False), CALIBRATED)
    assert len(chapter["results"]) == 1
    assert chapter["coefficient"] == chapter["superseded"] == chapter["held_out"] == ""
    assert "with the best explanation by 0.31°; noise" in chapter["gap_sentence"]
    assert chapter["suggestion_sentence"] == (
        "To tell camera delay from gripper scale, record the star: a signal-to-noise ratio of 5.5"
        " is expected."
    )
    assert [row[0] for row in chapter["suggestions"]] == ["the star", "four circles"]
    assert "--held-out" in chapter["held_sentence"]


def test_next_experiment_that_would_not_help_is_not_recommended(section):
    weak = [one for one in TIED["suggestions"] if one["snr"] < narrative.SEEN]
    sentence = narrative.suggestion_sentence({**section, **TIED, "suggestions": weak})
    assert sentence.startswith("None of the experiments considered would tell camera delay from")


def test_chapter_of_an_explanation_that_held_out_data_refute(section):
    chapter = criticism_chapter({**section, **UNKNOWN}, made(after=False, held=False), CALIBRATED)
    assert "camera delay explains these data, but not the recordings" in chapter["results"][0]
    assert "camera delay does not hold on third.nc" in chapter["held_sentence"]
    assert chapter["sources"][0]["rows"][0][-1] == "refuted by held-out data"


def test_chapter_of_a_model_that_agrees(section):
    gap = {**dict.fromkeys(section["gap_deg"]), "before": 0.3, "noise": 0.33}
    tree = made(after=False, status=["not needed"] * 3)
    chapter = criticism_chapter({**section, **NONE, "gap_deg": gap}, tree, CALIBRATED)
    assert chapter["gap_sentence"] == (
        "Recorded and expected inclination differ by 0.30° RMS; noise of cameras and simulator"
        " would leave 0.33°."
    )
    assert "In no stroke" in chapter["where_sentence"]
    assert chapter["sources"][0]["rows"][1][4:6] == ["–", "–"]


def test_without_clean_recordings_the_reader_is_warned(section):
    warning = "Without clean recordings (--baseline) the residual may be the simulator's own."
    assert narrative.baseline_sentence({**section, "baseline": 0}) == warning
    assert warning not in narrative.baseline_sentence(section)


def test_what_was_accepted_on_request_is_not_said_to_be_found(section):
    asked = {**section, **NONE, "accepted": ["stick_mass"], "accepted_by": "user"}
    assert narrative.accepted_sentence(asked).startswith("Stick mass joined the model on request")
    assert narrative.accepted_sentence(section) == ""


def test_effects_that_could_not_be_simulated_are_named(section):
    assert narrative.untested_sentence(section) == ""
    assert "with stick mass failed" in narrative.untested_sentence(
        {**section, "untested": ["stick_mass"]}
    )


def test_pours_have_their_own_verdict(section):
    pours = {"before": 0.051, "after": None, "p_value": 0.3, "verdict": "none", "effects": []}
    chapter = criticism_chapter({**section, "pours": pours}, made(pours=True), CALIBRATED)
    assert chapter["pours"]["sentence"] == (
        "Simulated and real pours agree (p = 0.3): nothing is known to be missing. Spilled and"
        " retained fractions differ by 5.1 percentage points RMS."
    )
    for text in ("spilled", "retained", "expected [% of the liquid]", "observed [% of the liquid]"):
        assert f">{text}<" in chapter["pours"]["figure"]
    assert [source["name"] for source in chapter["sources"]] == ["stirs", "pours"]


def test_plots_of_what_there_is_not_say_how_to_get_it(section):
    missing = bl.Criticism(SimpleNamespace(), made(), MappingProxyType(section))
    with pytest.raises(ValueError, match="held_out"):
        missing.plot_held_out()
    with pytest.raises(ValueError, match="pours"):
        missing.plot_pours()
    there = bl.Criticism(SimpleNamespace(), made(held=True, pours=True), MappingProxyType(section))
    assert "third.nc" in "".join(drawn(there.plot_held_out()))
    assert "as expected" in drawn(there.plot_pours())


def printed(section, found):
    console = Console(width=80, file=io.StringIO())
    print_criticism(section, found, console)
    return console.file.getvalue()


@pytest.mark.parametrize("changes", [{}, TIED, UNKNOWN, NONE])
def test_the_command_line_fits_a_terminal(section, changes):
    text = printed({**section, **changes, "baseline": 0}, effects(["accepted"] * 3)[0])
    lines = text.splitlines()
    assert len(lines) <= 20
    assert max(map(len, lines)) <= 80
    assert narrative.NO_BASELINE in text


def test_the_command_line_says_what_was_found(section):
    text = printed(section, None)
    assert "the missing effect is camera delay" in text
    assert "camera delay: 0.05 s (90 %: 0.04 to 0.06)" in text
    assert "difference: before 1.25 deg RMS, after 0.31 deg\n" in text
    assert "held out: before 1.50 deg RMS, after 0.42 deg (noise: 0.33 deg)" in text
    assert "surest in stroke 1, xz plane, 1.0 to 2.0 s (1-first.nc): 2.50 deg RMS" in text


def test_the_command_line_says_what_came_near_and_what_to_record(section):
    found = effects(["rejected"] * 3)[0]
    text = printed({**section, **TIED}, found)
    assert "explain most: camera delay (gain 286.0, p = 0.8); stick mass (gain 4.0" in text
    assert "gripper scale (gain" not in text
    assert "record the star" in text
    refuted = printed({**section, **UNKNOWN}, effects(["accepted", "rejected", "rejected"])[0])
    assert "camera delay explains these data, but not" in " ".join(refuted.split())


@pytest.fixture
def criticised(calibration, section, tmp_path):
    """A copy of a calibrated run with a criticism in it."""
    run = tmp_path / "run"
    shutil.copytree(calibration.path, run)
    names = calibration.summary["parameters"]
    section["parameters"] = {name: spread(0.1) for name in names} | section["coefficient"]
    write_section(run, "criticise", section)
    write_tree(made(held=True), run / CRITICISM)
    return run


def test_page_shows_the_criticism_before_the_pour(criticised):
    page = bl.report(criticised).read_text(encoding="utf-8")
    verdict = "<strong>Simulation and data differ (p = 0.002): the missing effect is camera delay."
    assert page.count(verdict) == 2
    assert page.index("What the simulator lacks") < page.index("<h2>The pour")
    assert "The calibration itself, without camera delay, had found:" in page
    made_how = page[page.index("How this was made") :]
    assert "77 to criticise it with" in made_how
    assert "baseline clean.nc, SHA-256" in made_how
    assert "abc123" in made_how
    assert "criticism: accepted_by" in made_how
    ids = re.findall(r'\sid="([^"]*)"', page)
    figures = [name for name in ids if name.startswith("figure_")]
    assert len(figures) == len(re.findall("<svg", page))


def test_page_without_a_criticism_says_how_to_get_one(calibration):
    page = bl.report(calibration.path).read_text(encoding="utf-8")
    assert f"bolfi-liquids criticise {calibration.path}" in page
    assert "Where they differ" not in page
