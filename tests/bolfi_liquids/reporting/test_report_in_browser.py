"""The page as a reader has it: in Chromium, without network."""

import base64
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.reporting.frames import _stack
from bolfi_liquids.reporting.moving_pictures import BYTE_LEVELS, _packed, moving_context
from bolfi_liquids.reporting.scenes import MOST_SHOWN

WIDTHS = {"laptop": (1280, 800), "phone": (390, 844)}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page(pour, frames):
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
        "[...document.querySelectorAll('figure svg, canvas')]"
        ".map((e) => e.getBoundingClientRect()).map((b) => Math.min(b.width, b.height))"
    )
    assert len(sizes) == 5 + 2 and min(sizes) > 80


def test_the_value_under_the_pointer_is_the_recordings(opened, calibration):
    tab, heard = opened
    recorded = calibration.tree["recorded"]
    sample = recorded.sizes["frame"] // 2
    chart = tab.locator(".chart").first
    chart.scroll_into_view_if_needed()
    at = chart.evaluate(
        """(chart, time) => {
            const panel = JSON.parse(chart.querySelector("script").textContent)[0];
            const [low, high] = panel.x.ends;
            const x = panel.box[0] + (panel.box[2] - panel.box[0]) * (time - low) / (high - low);
            const svg = chart.querySelector("svg");
            const point = new DOMPoint(x, (panel.box[1] + panel.box[3]) / 2);
            const on = point.matrixTransform(svg.getScreenCTM());
            return [on.x, on.y];
        }""",
        float(recorded["time"][sample]),
    )
    if tab.evaluate("navigator.maxTouchPoints") > 0:
        tab.touchscreen.tap(*at)
    else:
        tab.mouse.move(*at)
    said = tab.locator("#tip").inner_text()
    angle = np.degrees(float(recorded["inclination"][sample, 0]))
    assert f"recorded: {float(f'{angle:.3g}'):g} deg" in said
    assert heard["console"] == []


def test_a_draw_is_picked_in_all_figures(opened, frames):
    tab, heard = opened
    tab.locator("input[name=draw]").nth(2).check()
    told = tab.locator("[data-draw-text=liquid]").all_inner_texts()
    assert told == [told[0]] * 2 and f"{float(frames['viscosity'][2]):.3g}" in told[0]
    points = tab.locator("polyline.drawn").first.get_attribute("points").split()
    assert len(points) == frames.sizes["frame"]
    assert heard["console"] == []


def test_the_picture_moves(opened):
    tab, heard = opened
    figure = tab.locator("[data-movie=pour]")
    shot = "canvas => canvas.toDataURL()"
    canvas, slider = figure.locator("canvas"), figure.locator("input")
    before = canvas.evaluate(shot)
    slider.evaluate("e => { e.value = e.max / 2; e.dispatchEvent(new Event('input')); }")
    assert canvas.evaluate(shot) != before
    button = figure.locator("button")
    button.click()
    ended = "button => button.textContent === 'Play'"
    tab.wait_for_function(ended, arg=button.element_handle(), timeout=60_000)
    assert slider.evaluate("e => e.value === e.max")
    assert heard["console"] == []


def test_dragging_enlarges_and_a_double_click_goes_back(opened):
    tab, _ = opened
    svg = tab.locator(".chart svg").first
    svg.scroll_into_view_if_needed()
    whole, box = svg.get_attribute("viewBox"), svg.bounding_box()
    middle = box["x"] + box["width"] / 4, box["y"] + box["height"] / 2
    tab.mouse.move(*middle)
    tab.mouse.down()
    tab.mouse.move(middle[0] + 60, middle[1] + 40)
    tab.mouse.up()
    _, _, width, height = map(float, svg.get_attribute("viewBox").split())
    assert width / height == pytest.approx(60 / 40, rel=0.01)
    svg.dblclick()
    assert svg.get_attribute("viewBox") == whole


def test_the_frames_lose_no_liquid_and_lean_as_the_simulator_says(frames):
    assert (frames["caught"].diff("pour_frame") >= 0.0).all()
    shown = frames["poured"][..., 0].notnull().mean("pour_particle")
    np.testing.assert_array_equal(shown[:, 0], 1.0)
    flying = shown[:, -1] - frames["retained"]  # of those shown, which are some of all
    yet = 1.0 - frames["spilled"] - frames["retained"] - frames["caught"][:, -1]
    assert ((yet > -1e-9) & (yet < flying + 0.02)).all()
    stick = (frames["tip"] - frames["pivot"]).to_numpy()
    leaning = np.arctan2(stick[..., :2], -stick[..., 2:])
    seen = frames["inclination"].to_numpy()
    for draw in range(frames.sizes["draw"]):
        for plane in range(2):
            between = np.interp(frames["stir_time"], frames["time"], seen[draw, :, plane])
            # both are interpolated, between samples and between steps
            assert np.abs(between - leaning[draw, :, plane]).max() < np.radians(0.3)


def test_both_halves_of_the_cup_are_shown(frames):
    across = frames["poured"][:, 0, :, 1]
    np.testing.assert_allclose((across > 0.0).mean("pour_particle"), 0.5, atol=0.01)
    assert across.sizes["pour_particle"] <= MOST_SHOWN


def test_a_draw_that_failed_is_not_shown(shown, frames):
    broken = frames.copy(deep=True)
    broken["tip"][1] = np.nan
    moving = moving_context(shown, broken)
    kept = [draw["theta"]["viscosity"] for draw in moving["draws"]]
    assert kept == frames["viscosity"].to_numpy()[[0, 2]].tolist()
    assert len(moving["scenes"]["stir"]["positions"]) == 2
    broken["spilled"][:] = np.nan
    assert moving_context(shown, broken) is None


def test_draws_of_unlike_fills_are_stacked():
    few, many = (SimpleNamespace(position=np.ones((4, n, 3))) for n in (5, 7))
    stacked = _stack([few, many], "position")
    assert stacked.shape == (2, 4, 7, 3)
    assert np.isnan(stacked[0, :, 5:]).all() and np.isfinite(stacked[1]).all()


def test_a_packed_position_is_within_half_a_step(rng):
    position = rng.normal(size=(1, 2, 5, 3)).astype(np.float32)
    position[0, 1, 3] = np.nan
    packed = _packed(position)
    read = np.frombuffer(base64.b64decode(packed["positions"][0]), np.uint8).reshape(2, 5, 3)
    low, high = np.array(packed["low"]), np.array(packed["high"])
    back = np.where(read == 255, np.nan, low + (high - low) / BYTE_LEVELS * read)
    step = (high - low) / BYTE_LEVELS
    assert np.isnan(back[1, 3]).all() and np.isnan(back).sum() == 3
    assert np.nanmax(np.abs(back - position[0]) / step) <= 0.5 + 1e-4
