import numpy as np
import pytest
from bolfi_liquids.models.validation.truths import dam_break
from bolfi_liquids.models.validation.truths.dam_break import Track


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


def test_ritters_flow_keeps_volume_and_momentum():
    """h_t + (h u)_x = 0 and u_t + u u_x + g h_x = 0 between the two ends of what flows."""
    depth, step = 0.1, 1e-5
    wave = np.sqrt(9.81 * depth)
    x, t = np.linspace(-0.9, 1.9, 15) * wave * 0.3, 0.3

    def h(x, t):
        return dam_break.ritter_depth(x, t, depth)

    def u(x, t):
        return dam_break.ritter_speed(x, t, depth)

    def over_time(f):
        return (f(x, t + step) - f(x, t - step)) / (2 * step)

    def over_place(f):
        return (f(x + step, t) - f(x - step, t)) / (2 * step)

    lost = over_time(h) + over_place(lambda x, t: h(x, t) * u(x, t))
    np.testing.assert_allclose(lost, 0.0, atol=1e-6)
    pushed = over_time(u) + u(x, t) * over_place(u) + 9.81 * over_place(h)
    np.testing.assert_allclose(pushed, 0.0, atol=1e-6)


def test_ritters_flow_begins_and_ends_where_its_waves_are():
    depth, time = 0.1, 0.3
    wave = np.sqrt(9.81 * depth)
    ends = np.array([-1.5, -1.0, 0.0, 2.0, 3.0]) * wave * time
    np.testing.assert_allclose(
        dam_break.ritter_depth(ends, time, depth), [depth, depth, 4 / 9 * depth, 0, 0], atol=1e-15
    )
    speed = dam_break.ritter_speed(ends, time, depth) / wave
    np.testing.assert_allclose(speed, [0, 0, 2 / 3, 2, 2], atol=1e-15)
    length = wave * time  # the reservoir is untouched at its wall until then
    assert dam_break.ritter_end(length, depth) == pytest.approx(time)
