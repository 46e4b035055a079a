"""The report is one file that shows what the run holds."""

import html
import re
import shutil
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from html.parser import HTMLParser
from multiprocessing import get_context

import numpy as np
import pytest
from bolfi_liquids.inference.simulations import Compute
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.calibration.summary import ParameterSummary
from bolfi_liquids.cli.app import app
from bolfi_liquids.cli.printed import print_pour
from bolfi_liquids.reporting.facts import calibration_facts, criticism_facts, fit_facts, pour_facts
from bolfi_liquids.reporting.films import N_DRAWS_SHOWN, films_of
from bolfi_liquids.reporting.prose import prose
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


def test_report_is_one_file_with_every_figure_and_the_runs_numbers(pour, calibration):
    path = bl.report(pour.path, moving=False)
    assert path == pour.path / "report.html"
    text, page = read(path)
    assert page.outside == []
    assert not re.search(r"https?:|@import|url\((?!#)", text)
    assert page.figures == len(FIGURES)
    for label, figure in FIGURES.items():
        assert label in text, figure
    summary = calibration.summary
    assert f"{summary.fit_rms_deg:.2f}° RMS" in text
    assert f"{summary.parameters['viscosity'].q50:.3g} Pa s" in text
    assert f"{np.degrees(pour.chosen.angular_velocity):.1f}°/s" in text
    assert re.search("contact angle.* 60°", text)
    assert calibration.record["inputs"]["sha256"][0] in text


def test_report_of_a_calibration_alone_shows_run_toml_and_says_what_may_follow(
    calibration, tmp_path
):
    for name in ("run.toml", "posterior.nc"):  # as little as it needs
        shutil.copy(calibration.path / name, tmp_path)
    text, page = read(bl.report(tmp_path, moving=False))
    record = (tmp_path / "run.toml").read_text(encoding="utf-8")
    assert "[settings.prior.viscosity]" in record and record in html.unescape(text)
    for step in ("pour", "criticise"):
        assert f"bolfi-liquids {step} {tmp_path}" in text
    assert page.figures == len(FIGURES) - 1
    assert "Where they differ" not in text


@pytest.fixture
def unseen(pour, tmp_path):
    """A copy of the run whose moving pictures were never made."""
    run = shutil.copytree(pour.path, tmp_path / "unseen")
    shutil.rmtree(run / "moving", ignore_errors=True)
    return run


def late(film):
    raise TimeoutError


class Recorded(ThreadPoolExecutor):
    """Notes what it is to make, and takes too long."""

    asked = ()

    def map(self, made, films):
        self.asked = [made.keywords, list(films)]
        return super().map(late, films)


def test_films_are_simulated_by_the_executor_within_the_limit(unseen):
    results = bl.Calibration.open(unseen), bl.Pour.open(unseen)
    with Recorded(1) as pool, pytest.raises(RuntimeError, match="60 s"):
        films_of(*results, Compute(pool, 60.0), progress=False)
    (limits, films) = pool.asked
    assert limits == {"timeout": 60.0} and len(films) == 2 * N_DRAWS_SHOWN


@pytest.mark.slow
def test_pictures_that_take_too_long_leave_nothing(unseen):
    with pytest.raises(RuntimeError, match="moving=False"):
        bl.report(unseen, timeout=1e-9, progress=False)
    assert list((unseen / "moving").iterdir()) == []


@pytest.mark.minutes
def test_pictures_by_processes_have_the_same_bits(unseen, films):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        results = bl.Calibration.open(unseen), bl.Pour.open(unseen)
        there = films_of(*results, Compute(pool), progress=False)
    assert [film.path.name for film in there] == [film.path.name for film in films]
    for film, other in zip(there, films, strict=True):
        assert film.path.read_bytes() == other.path.read_bytes()


@pytest.mark.slow
def test_only_films_that_are_missing_are_made_and_old_ones_go(unseen, films):
    results = bl.Calibration.open(unseen), bl.Pour.open(unseen)
    (unseen / "moving").mkdir()
    for film in films[1:]:
        (unseen / "moving" / film.path.name).write_bytes(b"kept")
    (unseen / "moving" / "stir-0123456789ab.webp").write_bytes(b"of another posterior")
    first, *others = films_of(*results, Compute(), progress=False)
    assert first.path.read_bytes() == films[0].path.read_bytes()
    assert all(film.path.read_bytes() == b"kept" for film in others)
    assert len(list((unseen / "moving").iterdir())) == len(films)


@pytest.mark.slow
def test_a_draw_that_failed_is_not_shown(unseen, films):
    (unseen / "moving").mkdir()
    for film in films:
        content = b"" if film is films[1] else film.path.read_bytes()
        (unseen / "moving" / film.path.name).write_bytes(content)
    text, _ = read(bl.report(unseen, progress=False))
    assert text.count("<details><summary><img") == len(films) - 1


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


def poured(run):
    return re.search("<dt>Pour</dt>\n(.*)", bl.report(run, moving=False).read_text("utf-8"))[1]


def test_a_forced_pour_is_said_first(pour, tmp_path, with_numbers):
    run = shutil.copytree(pour.path, tmp_path / "run")
    assert "--force" not in poured(run)
    with_numbers(run, fit_rms_deg=2.1, noise_deg=0.24)
    assert "--force" in poured(run)


def test_a_result_that_does_not_count_is_warned_of(pour, tmp_path, caplog):
    """The page is whole without it: no error."""
    run = shutil.copytree(pour.path, tmp_path / "run")
    (run / "pour.nc").write_bytes(b"damaged")
    result = CliRunner().invoke(app, ["report", str(run), "--still"])
    assert (result.exit_code, result.stdout.strip()) == (0, str(run / "report.html"))
    assert result.stderr.count("pour.nc is damaged") == 1
    assert "make it again: bolfi-liquids pour" in result.stderr
    caplog.clear()
    bl.report(run, moving=False)
    assert "pour.nc is damaged" in caplog.text


@pytest.mark.parametrize(
    ("low", "high", "learned", "at_end"),
    [(0.1, 0.98, False, False), (0.1, 0.3, True, False), (0.0, 0.3, True, True)],
)
def test_learned_is_told_from_not_learned(calibration, low, high, learned, at_end):
    """The prior of the cohesion is uniform between 0 and 1."""
    values = ParameterSummary(mean=0.2, sd=0.1, q05=low, q50=0.2, q95=high)
    summary = replace(calibration.summary, parameters={"cohesion": values})
    facts = calibration_facts(replace(calibration, summary=summary))
    (one,) = facts["parameters"]
    assert one["learned"] == learned and (one["at_end"] == at_end or not learned)
    (said,) = prose("liquid", {"calibration": facts})
    assert f"between {low:g} and {high:g}" in said
    assert ("end of the prior" in said) == at_end
    assert ("little" in said) != learned
    share = float(one["share"].removesuffix(" %"))
    assert share == pytest.approx(100.0 * (high - low) / 0.9, abs=5.0)


@pytest.mark.parametrize(
    ("viscosity", "rms", "fit"),
    [(1.0, 0.3, "at noise"), (1.0, 0.4, "near noise"), (1.0, 0.7, "above noise")]
    + [(1e-3, 0.65, "within error")],
)
def test_the_fit_is_measured_by_noise_and_error(calibration, viscosity, rms, fit):
    closest = {"viscosity": viscosity, "cohesion": 0.5}
    summary = replace(calibration.summary, closest=closest, fit_rms_deg=rms, noise_deg=0.3)
    facts = fit_facts(summary)
    assert facts["fit"] == fit
    said, _ = prose("fit", {"calibration": facts})
    assert f"{rms:.2f}°" in said and "0.30°" in said


def test_box_table_and_terminal_show_one_number(pour, capsys):
    """A little spillage, of which each had another rounding; the plug-in is another action."""
    other = replace(pour.summary, distance_cm=1.236, expected_spillage=0.02)
    little = replace(pour.summary, expected_spillage=0.0019, spillage_q95=0.0123)
    shown = replace(pour, summary=replace(little, plug_in=little))
    print_pour(shown)
    printed, facts = capsys.readouterr().out, pour_facts(shown)
    for name in ("turn", "distance", "spilled", "spilled_q95"):
        assert printed.count(facts[name]) >= 2, name
    assert facts["spilled"] == "under 0.25 %" and "0.19" not in printed and facts["same"]
    facts = pour_facts(replace(pour, summary=replace(little, plug_in=other)))
    assert not facts["same"]
    assert facts["plug_in"]["distance"] == "1.24 cm" and facts["plug_in"]["spilled"] == "2 %"


@pytest.fixture
def criticised(calibration, criticism_summary, tmp_path, keep_criticism):
    """A copy of a calibrated run with a criticism in it."""
    run = shutil.copytree(calibration.path, tmp_path / "run")
    of_a_delay = criticism_summary.coefficient["camera_delay"]
    parameters = dict.fromkeys(calibration.summary.parameters, of_a_delay)
    return keep_criticism(run, parameters=parameters | dict(criticism_summary.coefficient))


@pytest.mark.slow
def test_page_shows_the_criticism_before_the_pour(criticised):
    page = bl.report(criticised, moving=False).read_text(encoding="utf-8")
    facts = {"criticism": criticism_facts(bl.Criticism.open(criticised))}
    for part in ("verdict", "criticism", "gap", "where", "undetectable"):
        for paragraph in prose(part, facts):
            assert page.count(f">{html.escape(paragraph, quote=False)}".replace("'", "&#39;")) == 1
    assert page.index("Where they differ") < page.index('<h2 id="pour">')
    how = page[page.index("How this was made") :]
    assert "77 simulations" in how
    for text in ("clean.nc", "abc123", "camera_delay", "camera_tilt", "held_out"):
        assert text in how
