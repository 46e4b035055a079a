"""The page as a reader has it: in Chromium, without network."""

import re
import shutil

import numpy as np
import pytest
from PIL import Image

import bolfi_liquids as bl
from bolfi_liquids.reporting.films import FILM_RATE, MAX_STIR_SECONDS, N_DRAWS_SHOWN

WIDTHS = {"laptop": (1280, 800), "phone": (360, 740)}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page(pour, films):
    return bl.report(pour.path, progress=False)


@pytest.fixture(scope="module")
def browser():
    sync = pytest.importorskip("playwright.sync_api")
    found = next(filter(None, map(shutil.which, BROWSERS)), None)  # or playwright's own
    with sync.sync_playwright() as playwright:
        try:
            started = playwright.chromium.launch(
                executable_path=found, args=["--no-sandbox", "--disable-gpu"]
            )
        except sync.Error:
            pytest.skip("no Chromium: make browser installs one")
        yield started
        started.close()


# the phone differs by width and touch: one screen for continuous integration
@pytest.fixture(params=["laptop", pytest.param("phone", marks=pytest.mark.minutes)])
def opened(browser, page, request):
    """The page, and what its console said and what it asked for."""
    width, height = WIDTHS[request.param]
    size, touch = {"width": width, "height": height}, request.param == "phone"
    tab = browser.new_page(viewport=size, offline=True, has_touch=touch)
    heard = {"console": [], "requests": []}
    tab.on("console", lambda message: heard["console"].append(message.text))
    tab.on("pageerror", lambda error: heard["console"].append(str(error)))
    tab.on("request", lambda asked: heard["requests"].append(asked.url))
    tab.goto(page.as_uri())
    yield tab, heard
    tab.close()


def test_it_is_whole_silent_and_as_wide_as_the_screen(opened, page):
    tab, heard = opened
    assert heard == {"console": [], "requests": [page.as_uri()]}
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    sizes = tab.evaluate(
        "[...document.querySelectorAll('figure svg, summary img')]"
        ".map((e) => e.getBoundingClientRect()).map((b) => Math.min(b.width, b.height))"
    )
    assert len(sizes) == 5 + 2 * N_DRAWS_SHOWN and min(sizes) > 80


def test_the_value_under_the_pointer_is_the_recordings(opened, calibration):
    tab, heard = opened
    recorded = calibration.tree["recorded"]
    titles = tab.evaluate(
        """() => {
            const svg = document.querySelector("figure svg");
            svg.scrollIntoView();
            const box = svg.getBoundingClientRect();
            const seen = [];
            for (let x = box.left; x < box.left + box.width / 2; x += 2) {
                const group = document.elementFromPoint(x, box.top + box.height / 2);
                const title = group?.closest("g")?.querySelector(":scope > title");
                if (title && !seen.includes(title.textContent)) seen.push(title.textContent);
            }
            return seen;
        }"""
    )
    assert len(titles) > 20
    angles = np.degrees(recorded["inclination"][:, 0].to_numpy())
    for title in titles:
        time, angle = map(float, re.match(r"([\d.]+) s: recorded (-?[\d.]+)°", title).groups())
        at = int(np.argmin(np.abs(recorded["time"].to_numpy() - time)))
        assert angle == pytest.approx(angles[at], abs=0.005 + 1e-9)
    assert heard["console"] == []


def test_a_click_plays_a_film_and_another_ends_it(opened):
    tab, heard = opened
    film = tab.locator(".films details").first
    still, moving = film.locator("summary img"), film.locator("> img")
    assert still.is_visible() and not moving.is_visible()
    film.locator("summary").click()
    assert moving.is_visible() and not still.is_visible()
    film.locator("summary").click()
    assert still.is_visible() and not moving.is_visible()
    assert heard["console"] == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_wrong_on_a_phone_with_all_unfolded(browser, page, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    width, height = WIDTHS["phone"]
    tab = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
    tab.goto(page.as_uri())
    tab.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    found = axe.run(tab)
    tab.close()
    assert found.violations_count == 0, found.generate_report()


def test_the_first_screen_of_a_phone_holds_every_answer(browser, page):
    width, height = WIDTHS["phone"]
    tab = browser.new_page(viewport={"width": width, "height": height})
    tab.goto(page.as_uri())
    ends = tab.evaluate(
        "[...document.querySelectorAll('dt')].map((e) => e.getBoundingClientRect().bottom)"
    )
    tab.close()
    assert len(ends) == 4 and max(ends) < height


def test_films_show_all_of_the_stir_and_the_pour(films, calibration):
    time = calibration.tree["recorded"]["time"].to_numpy()
    shown = min(time[-1] - time[0], MAX_STIR_SECONDS)
    for film in films:
        with Image.open(film.path) as pictures:
            assert pictures.n_frames > 1
            if film.scene == "stir":
                assert pictures.n_frames == pytest.approx(FILM_RATE * shown, abs=2)
    names = ["stir"] * N_DRAWS_SHOWN + ["pour"] * N_DRAWS_SHOWN
    assert [film.scene for film in films] == names
    drawn = calibration.draws(N_DRAWS_SHOWN, int(calibration.record["settings"]["seed"]))
    for film, viscosity in zip(films, 2 * drawn["viscosity"].tolist(), strict=True):
        assert f"{viscosity:.3g} Pa s" in film.liquid
