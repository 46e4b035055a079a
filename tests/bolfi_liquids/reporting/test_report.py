"""The report is one file that shows what the run holds."""

import html
import re
import shutil
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from html.parser import HTMLParser
from multiprocessing import get_context

import pytest
import xarray as xr
from bolfi_liquids.inference.simulations import Compute

import bolfi_liquids as bl
from bolfi_liquids.calibration.summary import ParameterSummary
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.pouring.result import ActionSummary, PourSummary
from bolfi_liquids.reporting import criticism_sentences, frames, sentences
from bolfi_liquids.reporting.report import prior_text
from bolfi_liquids.run.result_file import _parsed
from bolfi_liquids.run.run import Run

FIGURES = {
    "inclination [deg]": "inclination against time",
    "RMS [deg]": "residual by stroke",
    "viscosity [Pa s]": "posterior",
    "discrepancy [deg² s]": "search",
    "angular velocity [deg/s]": "pour",
}


class References(HTMLParser):
    """Collects what a page would fetch, its ids, and its number of figures."""

    def __init__(self):
        super().__init__()
        self.outside, self.ids, self.figures = [], [], 0

    def handle_starttag(self, tag, attrs):
        self.figures += tag == "svg"
        for name, value in attrs:
            fetched = name.removeprefix("xlink:") in ("src", "href", "srcset", "data")
            if fetched and value and not value.startswith("#"):
                self.outside.append(value)
            if name == "id" and not re.match(r"DejaVu|m[0-9a-f]", value or ""):
                self.ids.append(value)


def read(path):
    text = path.read_text(encoding="utf-8")
    page = References()
    page.feed(text)
    return text, page


def test_report_is_one_file_with_every_figure(pour):
    path = bl.report(pour.path, moving=False)
    assert path == pour.path / "report.html"
    text, page = read(path)
    assert page.outside == []
    assert not re.search(r"https?:|@import|url\((?!#)", text)
    assert page.figures == len(FIGURES)
    for label, figure in FIGURES.items():
        assert label in text, figure


@pytest.mark.slow
def test_report_shows_the_runs_numbers(pour, calibration):
    text, _ = read(bl.report(pour.path, moving=False))
    summary = calibration.summary
    assert f"{summary.fit_rms_deg:.2f}° RMS" in text
    assert f"{summary.parameters['viscosity'].q50:.3g} Pa s" in text
    assert f"{pour.chosen.angular_velocity * 57.29578:.0f}°/s" in text
    assert "contact angle with the source was taken as 60°" in text
    assert calibration.record["inputs"]["sha256"][0] in text


@pytest.mark.parametrize(
    ("described", "text"),
    [
        ({"family": "LogUniform", "high": 20.0, "low": 0.003}, "LogUniform(0.003, 20)"),
        ({"family": "Normal", "loc": 0.5, "scale": 0.1}, "Normal(loc=0.5, scale=0.1)"),
        (
            {
                "family": "TruncatedDistribution",
                "base_dist": {"family": "Normal", "loc": 0.0, "scale": 1.0},
                "high": 2.0,
                "low": 0.0,
            },
            "TruncatedDistribution(base_dist=Normal(loc=0, scale=1), high=2, low=0)",
        ),
    ],
)
def test_a_prior_is_written_as_in_python(described, text):
    assert prior_text(described) == text


@pytest.fixture(scope="module")
def calibrated(calibration, tmp_path_factory):
    """The report of a run in which no more was done, of as little as it needs."""
    run = tmp_path_factory.mktemp("calibrated")
    for name in ("run.toml", "posterior.nc"):
        shutil.copy(calibration.path / name, run)
    return bl.report(run, moving=False)


def test_report_shows_the_priors(calibration, calibrated):
    text, _ = read(calibrated)
    for described in calibration.record["settings"]["prior"].values():
        assert html.escape(prior_text(described)) in text
    assert html.escape("{'family'") not in text


@pytest.fixture
def unseen(pour, tmp_path):
    """A copy of the run whose moving pictures were never made."""
    run = shutil.copytree(pour.path, tmp_path / "unseen")
    (run / "frames.nc").unlink(missing_ok=True)
    return run


def test_a_report_says_where_its_pictures_are_simulated(unseen, monkeypatch):
    seen = []

    def simulated(scenes, draws, workers, progress):
        seen.append((workers, progress, scenes.stir.timeout, scenes.pour.timeout))
        raise TimeoutError

    monkeypatch.setattr(frames, "_simulated", simulated)
    spawn = get_context("spawn")
    with ProcessPoolExecutor(1, spawn) as pool, pytest.raises(RuntimeError, match="60 s"):
        bl.report(unseen, executor=pool, timeout=60.0, progress=False)
    assert seen == [(pool, False, 60.0, 60.0)]


def test_no_result_is_opened_twice(pour, frames, monkeypatch):
    opened, read = [], xr.open_datatree

    def counted(file, **options):
        opened.append(file)
        return read(file, **options)

    monkeypatch.setattr(xr, "open_datatree", counted)
    _parsed.cache_clear()
    bl.report(bl.Pour.open(pour.path), progress=False)
    assert len(opened) == len(("posterior.nc", "pour.nc", "frames.nc"))


@pytest.mark.slow
def test_pictures_that_take_too_long_leave_nothing(unseen):
    with pytest.raises(RuntimeError, match="moving=False"):
        bl.report(unseen, timeout=1e-9, progress=False)
    assert not (unseen / "frames.nc").exists()


@pytest.mark.minutes
def test_pictures_by_processes_have_the_same_bits(unseen, shown):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        elsewhere = replace(shown.calibration, run=Run.open(unseen))
        given = shown._replace(calibration=elsewhere)
        there = frames.frames_of(given, Compute(pool), progress=False)
    assert there.identical(frames.frames_of(shown, Compute(), progress=False))


@pytest.mark.slow
def test_report_says_below_which_viscosity_liquids_look_alike(calibration, tmp_path, with_numbers):
    run = shutil.copytree(calibration.path, tmp_path / "run")
    for share, told in ((0.3, True), (0.0, False)):
        summary = replace(calibration.summary, below_least_viscosity=share)
        with_numbers(run, below_least_viscosity=share)
        text, _ = read(bl.report(run, moving=False))
        assert f"{summary.least_viscosity:.2g} (stir)" in text
        told_sentences = sentences.least_viscosity_sentences(summary)
        assert len(told_sentences) == told
        assert all(str(sentence) in text for sentence in told_sentences)


def test_report_without_a_pour_says_how_to_get_one(calibrated):
    text, page = read(calibrated)
    assert f"bolfi-liquids pour {calibrated.parent}" in text
    assert page.figures == len(FIGURES) - 1


@pytest.mark.slow
def test_file_names_are_escaped(calibration, tmp_path):
    path = shutil.copytree(calibration.path, tmp_path / "run")
    before = Run.open(path)
    tree, summary = before.required("calibrate"), calibration.summary.to_json()
    record = path / "run.toml"
    record.write_text(record.read_text().replace("short.nc", "<script>alert(1)</script>.nc"))
    run = Run.open(path)
    run.keep("calibrate", tree, run.made_from, summary)
    text, _ = read(bl.report(path, moving=False))
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert" in text


@pytest.mark.parametrize(
    ("low", "high", "key"),
    [
        (0.1, 0.98, "parameter_not_learned"),
        (0.1, 0.3, "parameter"),
        (0.0, 0.3, "parameter_at_the_end"),
    ],
)
def test_sentence_tells_learned_from_not_learned(rng, low, high, key):
    values = ParameterSummary(mean=0.2, sd=0.1, q05=low, q50=0.2, q95=high)
    sentence = sentences.parameter_sentence("cohesion", values, rng.uniform(size=2000))
    assert sentence.key == f"calibration.{key}"
    if key == "parameter":
        assert sentence.values["share"] == pytest.approx((high - low) / 0.9, abs=0.05)


@pytest.mark.parametrize(
    ("viscosity", "fit", "key"),
    [(1.0, 0.3, "fit_at_noise"), (1.0, 0.4, "fit_near_noise"), (1.0, 0.7, "fit_above_noise")]
    + [(1e-3, 0.65, "fit_within_error"), (1e-3, 0.9, "fit_above_noise")],
)
def test_sentence_measures_the_fit_by_noise_and_error(calibration, viscosity, fit, key):
    closest = {"viscosity": viscosity, "cohesion": 0.5}
    summary = replace(calibration.summary, closest=closest, fit_rms_deg=fit, noise_deg=0.3)
    assert sentences.fit_sentence(summary).key == f"calibration.{key}"


def test_sentence_repeats_no_action():
    chosen = ActionSummary(30.0, 1.234, 0.006, 0.01, 0.9, 0.8, 1.0, 0.1, 0.0, 0.2)
    more = {"least_viscosity": 0.01, "n_simulations": 100, "risk": "mean", "seed": 0}
    more |= {"fit_status": "acceptable", "map_error": 0.01}
    summary = PourSummary(**vars(chosen), **more, plug_in=chosen)
    assert sentences.plug_in_sentence(summary).key == "pour.plug_in_same"
    other = replace(summary, plug_in=replace(chosen, distance_cm=1.236, expected_spillage=0.02))
    sentence = sentences.plug_in_sentence(other)
    assert sentence.key == "pour.plug_in" and "2 %" in str(sentence)


def test_the_contact_angle_is_named_where_the_pour_had_one():
    settings = bundled_cups().settings()
    settings["source"]["contact_angle_deg"] = 110.0
    (sentence,) = sentences.contact_angle_sentences(settings)
    assert "was taken as 110°" in str(sentence)
    del settings["source"]["contact_angle_deg"]  # of a pour by an older version
    assert sentences.contact_angle_sentences(settings) == []


@pytest.fixture
def criticised(calibration, criticism_summary, tmp_path, keep_criticism):
    """A copy of a calibrated run with a criticism in it."""
    run = shutil.copytree(calibration.path, tmp_path / "run")
    of_a_delay = criticism_summary.coefficient["camera_delay"]
    parameters = dict.fromkeys(calibration.summary.parameters, of_a_delay)
    return keep_criticism(run, parameters=parameters | dict(criticism_summary.coefficient))


@pytest.mark.slow
def test_page_shows_the_criticism_before_the_pour(criticised, criticism_summary):
    page = bl.report(criticised, moving=False).read_text(encoding="utf-8")
    assert page.count(f"<strong>{criticism_sentences.verdict_sentence(criticism_summary)}") == 2
    assert page.index("What the simulator lacks") < page.index("<h2>The pour")
    (superseded,) = criticism_sentences.superseded_sentences(criticism_summary)
    assert str(superseded) in page
    how = page[page.index("How this was made") :]
    assert "77 to criticise it with" in how
    assert "baseline clean.nc, SHA-256" in how
    assert "abc123" in how
    assert "criticism: effects" in how
    assert "camera_delay, camera_tilt" in how and "held out" in how


def test_page_without_a_criticism_says_how_to_get_one(calibrated):
    page, _ = read(calibrated)
    assert f"bolfi-liquids criticise {calibrated.parent}" in page
    assert "Where they differ" not in page
