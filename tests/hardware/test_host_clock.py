import time

from bolfi_liquids.hardware.process import RealClock
from stepped_clock import SteppedClock


def test_what_is_due_happens_in_its_order_at_its_moment():
    clock, told = SteppedClock(10.0), []
    clock.at(10.5, lambda: told.append(("once", clock.now())))
    clock.every(0.25, lambda: told.append(("again", clock.now())))
    clock.sleep(0.1)
    assert told == [] and clock.now() == 10.1
    clock.sleep(0.65)
    assert told == [("again", 10.25), ("once", 10.5), ("again", 10.5), ("again", 10.75)]
    clock.sleep(-1.0)
    assert clock.now() == 10.75


def test_who_stands_still_does_not_stop_the_others():
    clock, ticks = SteppedClock(0.0), []
    clock.every(1.0, lambda: ticks.append(clock.now()))
    clock.at(1.5, lambda: clock.sleep(3.0))
    clock.sleep(2.0)
    # the sleeper wakes up late, since the stall was its own
    assert clock.now() == 4.5
    assert ticks == [1.0, 2.0, 3.0, 4.0]


def test_the_real_clock_is_the_computer_s():
    clock = RealClock()
    before = time.monotonic()
    clock.sleep(0.01)
    clock.sleep(-1.0)
    assert before + 0.01 <= clock.now() <= time.monotonic()


def test_a_session_on_the_stepped_clock_is_the_same_each_time(stepped):
    from bolfi_liquids.hardware.motion.stir_paths import stir
    from bolfi_liquids.hardware.rig_file import bundled_rig
    from bolfi_liquids.hardware.robot.orders import Began, Checked, Follow, Stop

    rig = bundled_rig()
    runs = []
    for _ in range(2):
        one = stepped(rig, "stirring", stir(rig).pose[0])
        one.when(Checked, lambda one=one: one.orders.put(Follow(stir(rig))))
        one.when(Began, lambda one=one: one.orders.put(Stop("enough")), after=2.0)
        one.run()
        runs.append(one.rows)
    assert len(runs[0]) > 250
    assert str(runs[0]) == str(runs[1])
