"""What a page's script says lies where the figure shows it."""

import json
import re

import numpy as np
import pytest

from bolfi_liquids.drawing import new_figure, plain_log_ticks, styled
from bolfi_liquids.hover_labels import (
    field,
    lines_of,
    marks,
    script_json,
    series,
    to_chart,
)


def parts(chart):
    svg, script = chart.split("\n<script")
    return svg, json.loads(script[script.index(">") + 1 : script.index("</script>")])


def at(panel, x, y):
    """The point of the SVG at values of the axes, from their ends alone."""
    left, top, right, bottom = panel["box"]

    def share(axis, value):
        scaled = np.log([*axis["ends"], value]) if axis["log"] else [*axis["ends"], value]
        return (scaled[2] - scaled[0]) / (scaled[1] - scaled[0])

    return (
        left + share(panel["x"], x) * (right - left),
        bottom - share(panel["y"], y) * (bottom - top),
    )


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize("nested", [False, True])
def test_a_marks_place_is_where_matplotlib_has_drawn_it(log, nested):
    with styled():
        figure = new_figure(5.0, 3.0)
        within = figure.subfigures(2, 1)[1] if nested else figure
        axes = within.subplots(1, 2)[1]
        axes.plot([0.02, 3.0], [0.5, 4.0])
        axes.plot([0.3], [2.0], "o")
        if log:
            plain_log_ticks(axes, "x")
        svg, (panel,) = parts(to_chart(figure, "one", [marks(axes, [0.3], [2.0], ["here"])]))
    ((x, y),) = re.findall(r'<use [^>]*x="([\d.]+)" y="([\d.]+)" style="fill: #[^"]*', svg)[-1:]
    assert at(panel, 0.3, 2.0) == pytest.approx((float(x), float(y)), abs=0.05)
    assert panel["marks"] == [[0.3, 2.0, "here"]]


def test_labelled_lines_are_said_as_they_are_drawn():
    figure = new_figure(2.0, 2.0)
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [2.0, 3.0], label="seen")
    axes.axhline(0.0)
    (readout,) = lines_of(figure)
    assert readout.content["at"] == [0.0, 1.0]
    assert readout.content["lines"] == [{"label": "seen", "y": [2.0, 3.0]}]


def test_values_that_are_missing_are_null():
    axes = new_figure(2.0, 2.0).subplots()
    lines = series(axes, [0.0, 1.0], {"seen": [np.nan, 1.23456]}).content["lines"]
    assert lines == [{"label": "seen", "y": [None, 1.235]}]


def test_a_field_keeps_its_orientation():
    axes = new_figure(2.0, 2.0).subplots()
    told = field(axes, [1.0, 2.0], [5.0, 6.0, 7.0], {"z": np.arange(6.0).reshape(2, 3)}, "%")
    assert told.content["fields"][0]["z"][1][2] == 5.0  # the last of both axes


def test_what_a_browser_could_not_read_is_refused():
    with pytest.raises(ValueError, match="not JSON compliant"):
        script_json([float("nan")])


def test_no_text_ends_the_script_that_holds_it():
    text = script_json(["</script><script>alert(1)</script>"])
    assert "<" not in text
    assert json.loads(text) == ["</script><script>alert(1)</script>"]
