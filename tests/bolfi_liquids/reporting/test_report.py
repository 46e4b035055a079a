"""The report is one file that shows what the run holds."""

import re
import shutil
from html.parser import HTMLParser

import pytest

import bolfi_liquids as bl
from bolfi_liquids.calibration.tree import write_tree
from bolfi_liquids.reporting.sentences import fit_sentence, parameter_sentence, sure_sentence
from bolfi_liquids.run.directory import CRITICISM
from bolfi_liquids.run.summary import write_section

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


def test_report_shows_the_runs_numbers(pour, calibration):
    text, _ = read(bl.report(pour.path, moving=False))
    section = calibration.summary
    assert f"{section['fit_rms_deg']:.2f}° RMS" in text
    assert f"{section['parameters']['viscosity']['q50']:.3g} Pa s" in text
    assert f"{pour.chosen.angular_velocity * 57.29578:.0f}°/s" in text
    assert calibration.record["inputs"]["sha256"][0] in text


def test_report_says_below_which_viscosity_liquids_look_alike(calibration, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(calibration.path, run)
    for share, told in ((0.3, True), (0.0, False)):
        section = dict(calibration.summary) | {"below_least_viscosity": share}
        write_section(run, "calibrate", section)
        text, _ = read(bl.report(run, moving=False))
        assert f"{section['least_viscosity']:.2g} (stir)" in text
        assert (f"Below about {section['least_viscosity']:.3g} Pa s" in text) == told


def test_report_without_a_pour_says_how_to_get_one(calibration, tmp_path):
    run = tmp_path / "run"
    run.mkdir()
    for name in ("run.toml", "posterior.nc"):
        shutil.copy(calibration.path / name, run)
    write_section(run, "calibrate", dict(calibration.summary))
    text, page = read(bl.report(run, moving=False))
    assert f"bolfi-liquids pour {run}" in text
    assert page.figures == len(FIGURES) - 1


def test_file_names_are_escaped(calibration, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(calibration.path, run)
    record = run / "run.toml"
    record.write_text(record.read_text().replace("short.nc", "<script>alert(1)</script>.nc"))
    text, _ = read(bl.report(run, moving=False))
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert" in text


@pytest.mark.parametrize(("high", "verdict"), [(0.98, "says little"), (0.3, "what the prior held")])
def test_sentence_tells_learned_from_not_learned(rng, high, verdict):
    values = {"q05": 0.1, "q50": 0.2, "q95": high}
    assert verdict in parameter_sentence("cohesion", values, rng.uniform(size=2000))


@pytest.mark.parametrize(
    ("fit", "verdict"),
    [(0.3, "as closely as can be"), (0.4, "1.3 times as much"), (0.9, "lacks")],
)
def test_sentence_measures_the_fit_by_the_noise(fit, verdict):
    section = {"fit_rms_deg": fit, "noise_deg": 0.3, "n_simulations": 20}
    assert verdict in fit_sentence(section)


def test_sentence_repeats_no_action():
    chosen = {
        "angular_velocity_deg_s": 30.0,
        "distance_cm": 1.234,
        "expected_spillage": 0.006,
        "spillage_q95": 0.01,
    }
    assert sure_sentence(chosen | {"plug_in": chosen}).endswith("θ* alone is the same.")
    other = chosen | {"distance_cm": 1.236, "expected_spillage": 0.02}
    assert "(30°/s, 1.2 cm) would spill 2 %" in sure_sentence(chosen | {"plug_in": other})


@pytest.fixture
def criticised(calibration, criticism_section, tmp_path, made):
    """A copy of a calibrated run with a criticism in it."""
    run = tmp_path / "run"
    shutil.copytree(calibration.path, run)
    names = calibration.summary["parameters"]
    criticism_section["parameters"] = {
        name: criticism_section["coefficient"]["camera_delay"] for name in names
    } | criticism_section["coefficient"]
    write_section(run, "criticise", criticism_section)
    write_tree(made(held=True), run / CRITICISM)
    return run


def test_page_shows_the_criticism_before_the_pour(criticised):
    page = bl.report(criticised, moving=False).read_text(encoding="utf-8")
    verdict = "<strong>Simulation and data differ (p = 0.002): the missing effect is camera delay."
    assert page.count(verdict) == 2
    assert page.index("What the simulator lacks") < page.index("<h2>The pour")
    assert "The calibration itself, without camera delay, had found:" in page
    how = page[page.index("How this was made") :]
    assert "77 to criticise it with" in how
    assert "baseline clean.nc, SHA-256" in how
    assert "abc123" in how
    assert "criticism: effects" in how
    assert "camera_delay, camera_tilt" in how and "held out" in how


def test_page_without_a_criticism_says_how_to_get_one(calibration):
    page = bl.report(calibration.path, moving=False).read_text(encoding="utf-8")
    assert f"bolfi-liquids criticise {calibration.path}" in page
    assert "Where they differ" not in page
