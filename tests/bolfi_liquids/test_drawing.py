"""What a browser shows under the pointer lies where the figure shows it."""

import html
import re

import numpy as np
import pytest

from bolfi_liquids.drawing import hover, hover_points, new_figure, plain_log_ticks, styled, to_svg

TITLE = re.compile(r"<g[^>]*><title>([^<]*)</title>(.*?)</g>", re.DOTALL)
PLACE = re.compile(r'<use [^>]*x="([\d.]+)" y="([\d.]+)"')


@pytest.mark.parametrize("log", [False, True])
def test_a_text_lies_on_the_mark_that_it_is_of(log):
    with styled():
        figure = new_figure(5.0, 3.0)
        axes = figure.subplots(1, 2)[1]
        axes.plot([0.02, 3.0], [0.5, 4.0])
        axes.plot([0.3], [2.0], "o", label="seen")
        if log:
            plain_log_ticks(axes, "x")
        svg = to_svg(figure, "without")
        (seen,) = PLACE.findall(svg)[-1:]
        hover_points(axes, [0.3, np.nan], [2.0, 1.0], ["here", "nowhere"])
        ((text, group),) = TITLE.findall(to_svg(figure, "with"))
    assert text == "here"
    ((x, y),) = PLACE.findall(group)
    assert (float(x), float(y)) == pytest.approx(tuple(map(float, seen)), abs=0.05)


def test_no_text_ends_the_title_that_holds_it():
    text = '</title><script>alert("1 & 2")</script>'
    figure = new_figure(2.0, 2.0)
    hover(figure.subplots().axvspan(0.0, 1.0), text)
    svg = to_svg(figure, "one")
    assert "<script" not in svg
    ((shown, _),) = TITLE.findall(svg)
    assert html.unescape(shown) == text
