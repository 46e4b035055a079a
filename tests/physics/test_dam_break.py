import numpy as np
import pytest
from truths import dam_break
from truths.dam_break import Track


@pytest.mark.parametrize("table", [*dam_break.FRONT.values(), *dam_break.HEIGHT.values()])
def test_tables_are_monotone(table):
    assert (np.diff(table.time) > 0).all()
    assert (np.abs(np.diff(np.sign(np.diff(table.value)))) == 0).all()


def test_fronts_begin_at_the_base_and_stay_below_the_shallow_water_limit():
    """Ritter's front runs at 2 sqrt(g h), h = n² a: dZ/dT = 2; real ones stay below it."""
    for table in dam_break.FRONT.values():
        assert 1.0 < table.value[0] < 1.2
        assert 1.0 < dam_break.front_speed(table) < 2.0


def test_two_tabulations_of_one_experiment_differ_by_a_fifth():
    once, repeated = dam_break.FRONT[2], dam_break.REPEATED_FRONT
    assert (np.diff(repeated.time) > 0).all() and (np.diff(repeated.value) > 0).all()
    ratio = dam_break.front_speed(repeated) / dam_break.front_speed(once)
    assert ratio == pytest.approx(1.2, abs=0.05)
    late = dam_break.fit_time_shift(repeated, once)
    assert abs(late.shift) < 0.25 and late.rms < 0.2


def test_times_are_made_dimensionless_as_in_the_paper():
    """T = t sqrt(2 g / a) for n² = 2."""
    assert dam_break.front_time(1.0, 2, 0.05715) == pytest.approx(np.sqrt(2 * 9.81 / 0.05715))
    assert dam_break.height_time(1.0, 0.05715) == pytest.approx(np.sqrt(9.81 / 0.05715))


@pytest.mark.parametrize("late", [-0.21, 0.0, 0.175])
def test_a_late_release_is_found_and_taken_out(late):
    table = dam_break.FRONT[2]
    fine = np.linspace(0.0, table.time[-1] + 0.5, 400)
    line = np.interp(fine + late, table.time, table.value)
    # beyond the table the front runs on at its speed
    line += np.maximum(fine + late - table.time[-1], 0.0) * 1.3
    fit = dam_break.fit_time_shift(Track(fine, line), table)
    assert fit.shift == pytest.approx(late, abs=0.01)
    assert fit.rms < 0.02
    speed = dam_break.front_speed(Track(fine, line))
    assert speed == pytest.approx(dam_break.front_speed(table), rel=0.03)


def test_a_track_that_ends_early_is_refused():
    short = Track(np.linspace(0, 0.8, 20), np.linspace(1, 1.2, 20))
    with pytest.raises(ValueError, match="simulate longer"):
        dam_break.fit_time_shift(short, dam_break.FRONT[2])
    with pytest.raises(ValueError, match="needs 3"):
        dam_break.front_speed(short)
