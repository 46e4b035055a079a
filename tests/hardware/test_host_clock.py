"""The clock that a test steps; the real one is the computer's."""

from stepped_clock import SteppedClock


def test_what_is_due_happens_in_its_order_at_its_moment():
    clock, told = SteppedClock(10.0), []
    clock.at(10.5, lambda: told.append(("once", clock.now())))
    clock.every(0.25, lambda: told.append(("again", clock.now())))
    clock.sleep(0.75)
    assert told == [("again", 10.25), ("once", 10.5), ("again", 10.5), ("again", 10.75)]
    clock.sleep(-1.0)
    assert clock.now() == 10.75


def test_who_stands_still_does_not_stop_the_others():
    clock, ticks = SteppedClock(0.0), []
    clock.every(1.0, lambda: ticks.append(clock.now()))
    clock.at(1.5, lambda: clock.sleep(3.0))
    clock.sleep(2.0)
    # the sleeper wakes up late, since the stall was its own
    assert (clock.now(), ticks) == (4.5, [1.0, 2.0, 3.0, 4.0])
