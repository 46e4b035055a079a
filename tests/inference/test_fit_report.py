"""The page of a fit: whole, described, and with the numbers of the fit."""

import shutil
from html.parser import HTMLParser

import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr

from bolfi_liquids import inference

HOW = {"budget": 14, "progress": False, "warn": False}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


class Page(HTMLParser):
    """Tags with their attributes, headings' levels, cells of tables, and all text."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.levels, self.cells, self.text = [], [], [], ""
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag in ("td", "th"):
            self.cells.append("")
        if tag[0] == "h" and tag[1:].isdigit():
            self.levels.append(int(tag[1:]))

    def handle_data(self, data):
        self.text += data
        if self.tags and self.tags[-1][0] in ("td", "th"):
            self.cells[-1] += data.strip()


@pytest.fixture(scope="module")
def prior():
    slope = dist.Uniform(-1.0, 1.0)
    return inference.Prior({"slope": slope, "粘度<b>": dist.LogUniform(0.1, 2)}, {"slope": "m"})


@pytest.fixture(scope="module")
def fit(simulate, prior, observed):
    def channels(theta, seeds):
        made = simulate({"slope": theta["slope"], "offset": theta["粘度<b>"]}, seeds)
        return np.stack([made, -made], axis=2)

    data = np.stack([observed, -observed], axis=1)
    data[4, 0] = np.nan
    return inference.fit(channels, prior, data, **HOW)


@pytest.fixture(scope="module")
def page(fit, tmp_path_factory):
    tree = fit.sample("quadrature", draws=200)
    return fit.report(tmp_path_factory.mktemp("page") / "out.html", tree), tree


def test_its_numbers_are_the_fit_s(page, fit):
    path, tree = page
    read = Page(path)
    for name in fit.prior.names:
        row = read.cells[read.cells.index(name if name != "slope" else "slope [m]") :][1:4]
        quantiles = np.quantile(tree["posterior"][name], [0.5, 0.05, 0.95])
        np.testing.assert_allclose([float(cell) for cell in row], quantiles, rtol=1e-3)
    assert fit.status in read.text.lower() and "粘度<b>" in read.text
    assert all(warning in read.text for warning in fit.warnings)
    assert f"{fit.evidence.log:.2f}" in read.text


def test_it_needs_nothing_from_outside_and_describes_its_figures(page):
    read = Page(page[0])
    pictures = [attributes for tag, attributes in read.tags if tag == "img"]
    assert len(pictures) == 2 + 2 + 1  # parameters, channels, errors
    assert all(one["src"].startswith("data:") and len(one["alt"]) > 20 for one in pictures)
    linked = {"href", "srcset", "action", "data", "poster"}
    assert not [a for tag, a in read.tags if tag in ("link", "script") or linked & set(a)]
    assert read.levels[0] == 1 and set(read.levels[1:]) == {2}


def test_the_same_fit_gives_the_same_page(page, fit, tmp_path):
    path, tree = page
    again = fit.report(tmp_path / "again.html", tree)
    assert again.read_bytes() == path.read_bytes()


def test_draws_of_another_fit_are_refused(fit, page, tmp_path):
    few = fit.history.first(6)
    engine = inference.Bolfi(fit.prior, fit.observed)
    engine.tell(fit.prior.to_dict(few.theta), few.signals)
    other = engine.fit(warn=False).sample("quadrature", draws=20)
    for wrong in (other, type(other)(), page[1]["posterior"]):
        with pytest.raises(ValueError, match="tree must be what `sample` of this fit"):
            fit.report(tmp_path / "out.html", wrong)
    page[1].to_netcdf(tmp_path / "draws.nc")
    with xr.open_datatree(tmp_path / "draws.nc") as tree:
        again = fit.report(tmp_path / "again.html", tree)
    assert again.read_bytes() == page[0].read_bytes()


@pytest.mark.parametrize(
    "surrogate", ["discrepancy", "log_likelihood", "summary", "one number", "constant"]
)
def test_every_surrogate_has_a_page(simulate, observed, tmp_path, surrogate):
    prior = inference.Prior({"slope": dist.Uniform(-1.0, 1.0), "offset": dist.Uniform(0.0, 1.0)})
    options = {
        "discrepancy": {"observed": observed, "surrogate": "discrepancy"},
        "log_likelihood": {"surrogate": "log_likelihood"},
        "summary": {"observed": observed, "summary": lambda signal: signal[[0, 15, 29]]},
        "one number": {"observed": observed[15]},
        "constant": {"observed": observed},
    }[surrogate]
    simulators = {
        "log_likelihood": lambda theta, _: -9.0 * (theta["slope"] ** 2 + theta["offset"] ** 2),
        "one number": lambda theta, seeds: simulate(theta, seeds)[:, 15],
        "constant": lambda theta, _: np.ones((len(theta["slope"]), observed.size)),
    }
    simulator = simulators.get(surrogate, simulate)
    fit = inference.fit(simulator, prior, confirm=0, **HOW, **options)
    path = fit.report(tmp_path / "out.html", fit.sample("quadrature", draws=50))
    assert "img" in dict(Page(path).tags)


@pytest.mark.slow
def test_it_is_as_wide_as_a_phone(page):
    sync = pytest.importorskip("playwright.sync_api")
    found = next(filter(None, map(shutil.which, BROWSERS)), None)  # or playwright's own
    with sync.sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        except sync.Error:
            pytest.skip("no Chromium: make browser installs one")
        size = {"width": 360, "height": 740}
        tab = browser.new_page(viewport=size, offline=True, color_scheme="dark")
        tab.goto(page[0].as_uri())
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
        drawn = tab.evaluate("[...document.images].map((one) => one.naturalWidth * one.width)")
        assert min(drawn) > 0
        dark = tab.evaluate("getComputedStyle(document.body).backgroundColor")
        assert max(map(int, dark[4:-1].split(","))) < 64
        browser.close()
