"""Cases of wetting and of films fail where these are absent."""

import numpy as np
import pytest
from truths.dam_break import FRONT, REPEATED_FRONT, Track
from wet_cases import (
    capillary_rise,
    contact_angle,
    dam_break,
    dewetting,
    film_flow,
    meniscus,
)


def judged_of(case, monkeypatch, change):
    """Rows of a case whose liquids are changed before they flow."""
    flow = case.flow_in_box

    def changed(box, liquids, *rest, **options):
        return flow(box, [change(liquid) for liquid in liquids], *rest, **options)

    monkeypatch.setattr(case, "flow_in_box", changed)
    return case.CASE.run(0).rows


def unwetted(liquid):
    return liquid._replace(angle=0.5 * np.pi)


def clamped(liquid):
    """Walls wet, and repel nothing."""
    return liquid._replace(angle=min(liquid.angle, 0.5 * np.pi))


@pytest.mark.slow
@pytest.mark.parametrize("case", [capillary_rise, meniscus])
def test_every_surface_whose_walls_neither_wet_nor_repel_is_out_of_tolerance(monkeypatch, case):
    for row in judged_of(case, monkeypatch, unwetted):
        assert row.passed == (abs(row.truth) < 1e-6), row


@pytest.mark.slow
@pytest.mark.parametrize("case", [capillary_rise, meniscus])
def test_walls_that_never_repel_are_out_of_tolerance(monkeypatch, case):
    rows = judged_of(case, monkeypatch, clamped)
    beyond = [row.passed for row in rows if "110" in row.quantity or "150" in row.quantity]
    assert beyond and not any(beyond)


@pytest.mark.slow
def test_drops_whose_floor_neither_wets_nor_repels_differ_too_little(monkeypatch):
    *drops, difference = judged_of(contact_angle, monkeypatch, unwetted)
    assert not difference.passed
    assert not any(row.passed for row in drops if "height, 60" in row.quantity)


@pytest.mark.slow
def test_edges_of_films_on_walls_that_never_repel_are_too_slow(monkeypatch):
    speeds = [row for row in judged_of(dewetting, monkeypatch, clamped) if "speed" in row.quantity]
    assert speeds and not any(row.passed for row in speeds)


def test_films_at_rest_are_out_of_tolerance(monkeypatch):
    def rest(box, liquids, bodies, seconds, look):
        time = np.linspace(0.0, seconds, 4)
        return time, np.zeros((4, len(liquids), 1 + film_flow.LAYERS))

    monkeypatch.setattr(film_flow, "flow_in_box", rest)
    assert not any(row.passed for row in film_flow.CASE.run(0).rows)


def test_a_front_between_two_published_speeds_has_no_error_and_others_do():
    time = np.linspace(0.0, 4.0, 50)
    ends = [dam_break.front_speed(table) for table in (FRONT[2], REPEATED_FRONT)]
    low, middle, high = (
        dam_break.speed_row(2, Track(time, 1.0 + speed * time))
        for speed in (0.8 * min(ends), 0.5 * sum(ends), 1.2 * max(ends))
    )
    assert middle.error == 0.0 and middle.ours == pytest.approx(middle.truth)
    assert low.error == pytest.approx(-0.2) and high.error == pytest.approx(0.2)
    lone = dam_break.front_speed(FRONT[1])
    row = dam_break.speed_row(1, Track(time, 1.0 + 1.05 * lone * time))
    assert row.truth == pytest.approx(lone) and row.error == pytest.approx(0.05)
