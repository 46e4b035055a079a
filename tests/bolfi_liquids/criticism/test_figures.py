"""Figures of a criticism that was made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.text import Text

import bolfi_liquids as bl
from bolfi_liquids.criticism.figures import (
    coefficient_plot,
    confusion_plot,
    residual_plot,
    score_plot,
    stroke_plot,
)
from bolfi_liquids.drawing import new_figure


def drawn(figure):
    """The texts of a figure."""
    figure.draw_without_rendering()  # which writes those of ticks
    return [text.get_text() for text in figure.findobj(Text) if text.get_visible()]


def panel(figure, title):
    """The axes whose title ends so."""
    return [axes for axes in figure.axes if axes.get_title(loc="left").endswith(title)]


def test_residuals_are_drawn_in_degrees_with_the_sure_stroke_shaded(made):
    tree = made()
    figure = residual_plot(tree["stirs"]).figure
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
    assert {"observed less expected [deg]", "time [s]", "1-first.nc\nxz plane"} <= set(texts)


def test_strokes_are_bars_of_rms_in_degrees(made):
    figure = stroke_plot(made()["stirs"]).figure
    assert len(figure.axes) == 6
    for axes in figure.axes:
        heights = [patch.get_height() for patch in axes.patches]
        np.testing.assert_allclose(heights, np.degrees(0.02))
    texts = drawn(figure)
    assert {"RMS [deg]", "stroke", "gripper's speed [cm/s]", "0 to 3"} <= set(texts)
    assert {"before", "with the missing effect"} <= set(texts)
    assert "with the missing effect" not in drawn(stroke_plot(made(after=False)["stirs"]).figure)


def test_effects_are_sorted_by_what_they_gain_or_else_by_score(made):
    figure = score_plot(made()["stirs"]).figure
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == ["camera delay", "stick mass", "gripper scale"]
    texts = drawn(figure)
    assert {"gain in log likelihood", "size of the score [sd]", "named", "rejected"} <= set(texts)
    tree = made(status=("named", "untested by a refit", "untested: its simulations failed"))
    tree["stirs/effects"]["gain"].values[1:] = np.nan
    texts = drawn(score_plot(tree["stirs"]).figure)
    assert [text for text in texts if "not fitted" in text] == [" not fitted"] * 2
    figure = score_plot(made(status=["not needed"] * 3)["stirs"]).figure
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == ["camera delay", "gripper scale", "stick mass"]
    assert len(figure.axes) == 1  # no gains to show beside the scores


def test_likeness_has_no_sign(made):
    texts = drawn(confusion_plot(made()["stirs"]).figure)
    assert texts.count("0.90") == 2
    assert texts.count("1.00") == 3
    assert "camera delay" in texts


def test_coefficient_is_drawn_in_its_unit_beside_no_effect(made):
    figure = coefficient_plot(made(), ["camera_delay"]).figure
    texts = drawn(figure)
    assert {"camera delay [s]", "90 % interval", "no effect"} <= set(texts)
    (neutral,) = [line for line in figure.axes[0].get_lines() if line.get_label() == "no effect"]
    assert set(neutral.get_xdata()) == {0.0}


def test_plots_of_what_there_is_not_say_how_to_get_it(criticism_summary, made):
    missing = bl.Criticism(SimpleNamespace(), made(), criticism_summary)
    with pytest.raises(ValueError, match="held_out"):
        missing.plot_held_out()
    with pytest.raises(ValueError, match="pours"):
        missing.plot_pours()
    there = bl.Criticism(SimpleNamespace(), made(held=True, pours=True), criticism_summary)
    assert "third.nc" in "".join(drawn(there.plot_held_out().flat[0].figure))
    assert "as expected" in drawn(there.plot_pours().flat[0].figure)


@pytest.mark.parametrize("plot", ["residuals", "strokes", "scores"])
def test_plots_draw_in_the_axes_that_are_given(criticism_summary, made, plot):
    criticism = bl.Criticism(SimpleNamespace(), made(), criticism_summary)
    panels = getattr(criticism, f"plot_{plot}")().ravel()
    figure = new_figure(9.0, 6.0)
    given = figure.subplots(len(panels), 1, squeeze=False)
    drawn = getattr(criticism, f"plot_{plot}")(axes=given)
    assert [*drawn.flat] == [*given.flat]
    for axes, expected in zip(given.flat, panels, strict=True):
        assert axes.get_xlabel() == expected.get_xlabel()
        assert len(axes.get_lines()) == len(expected.get_lines())
        assert len(axes.patches) == len(expected.patches)
    with pytest.raises(ValueError, match=f"needs .* axes, got {len(panels) + 1}"):
        getattr(criticism, f"plot_{plot}")(axes=figure.subplots(len(panels) + 1, 1))


def test_a_criticism_shows_what_it_holds(criticism_summary, made):
    criticism = bl.Criticism(SimpleNamespace(path="runs/<mine>"), made(), criticism_summary)
    for shown in (repr(criticism), criticism._repr_html_()):
        for part in ("mine", "effect", "0.002"):
            assert part in shown
    assert "<mine>" not in criticism._repr_html_()
    assert criticism.verdict == "effect" and criticism.advice
