"""Each fault during a motion, on a stepped clock: the arm comes to rest in time and says why.

`test_faults` has those that kill or stop whole processes, with the real client and in real time.
"""

import re

import numpy as np
import pytest
from bolfi_liquids.hardware.board import Trouble, Who
from bolfi_liquids.hardware.motion.stir_paths import stir
from bolfi_liquids.hardware.robot import ur
from bolfi_liquids.hardware.robot.orders import Began, Checked, Done, Follow, Leave, Stop
from short_rig import short_rig
from ur_controller.patience import patient

RIG = short_rig()
PATH = stir(RIG)


def changed(path, **change):
    pose = path.pose.copy()
    pose[change["at"]] = change["to"]
    return path._replace(pose=pose)


NAN_PATH = changed(PATH, at=(3, 1), to=np.nan)
OUTSIDE = changed(PATH, at=(slice(None), 0), to=0.2)
# what happens during a motion, the time in which the arm must rest [s], and words of the reason
FAULTS = {
    "late packages": (lambda one: setattr(one.emulator.faults, "late", 1.0), 0.3, "silence|delay"),
    "a frozen link": (lambda one: one.emulator.network.freeze(10.0), 0.3, "silence"),
    "a dropped link": (lambda one: one.emulator.network.drop(), 0.3, "connection"),
    "a silent recorder": (lambda one: one.silent.add(Who.RECORDER), 0.6, "recorder: no sign"),
    "a dead recorder": (lambda one: one.recorder.close(), 0.3, "recorder's process is gone"),
    "a full disk": (
        lambda one: one.trouble.update({Who.RECORDER: Trouble.WRITE_FAILED}),
        0.3,
        "recorder cannot write",
    ),
    "a silent camera": (lambda one: one.silent.add(Who.CAMERA_XZ), 0.5, "camera xz: no new"),
    "a frozen camera": (
        lambda one: one.trouble.update({Who.CAMERA_YZ: Trouble.SAME_PICTURE}),
        0.3,
        "camera yz gives the same picture",
    ),
    "a force": (lambda one: one.emulator.controller.force.press(PUSH), 0.3, "force: 3"),
    "a protective stop": (
        lambda one: one.emulator.controller.protective_stop("by the test"),
        0.3,
        "protective stopped",
    ),
    "a stall": (lambda one: one.clock.sleep(0.3), 0.3, "overrun"),
    "a short stall": (lambda one: one.clock.sleep(0.06), 0.3, "overrun: .* the limit is 0.05"),
    "an order of NaN": (lambda one: one.orders.put(Follow(NAN_PATH)), 0.3, "refused.*not finite"),
    "an order outside": (lambda one: one.orders.put(Follow(OUTSIDE)), 0.3, "refused.*outside"),
    "leaving": (lambda one: one.orders.put(Leave()), 0.3, "told to leave during a motion"),
    "a signal": (lambda one: one.links.signals.append("SIGHUP"), 0.3, "got SIGHUP"),
    # nothing is to be noticed first: all of it is the brake's time
    "main's stop": (lambda one: one.orders.put(Stop("enough")), 0.05, "enough"),
}
PUSH = (30.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_stops_the_arm_for_good_and_says_why(stepped, name):
    act, bar, reason = FAULTS[name]
    one = stepped(RIG, "stirring", PATH.pose[0], cameras=True)
    stopped, lasted = one.stopped_by(lambda: act(one), Follow(PATH), 1.0)
    assert re.search(reason, stopped.reason), stopped
    assert lasted < bar
    # samples go on until the arm rests, as far as the link lets them through
    assert [row.index for row in one.rows] == list(range(len(one.rows)))


@pytest.mark.parametrize("deceleration", [ur.STOP_DECELERATION, 1.0])
def test_the_arm_brakes_as_its_driver_asks(stepped, monkeypatch, deceleration):
    monkeypatch.setattr(ur, "STOP_DECELERATION", deceleration)
    one, speeds = stepped(RIG, "stirring", PATH.pose[0], cameras=True), []

    def stop():
        speeds.append(np.linalg.norm(one.emulator.controller.arm.velocity[:3]))
        one.orders.put(Stop("enough"))

    _, lasted = one.stopped_by(stop, Follow(PATH), 0.9)
    (speed,), tick = speeds, 1.0 / RIG.robot.rate
    assert speed == pytest.approx(RIG.stirring.speed, rel=0.05)
    assert speed / deceleration < lasted < speed / deceleration + 2 * tick


@pytest.mark.parametrize("name", ["a stall", "a frozen link"])
def test_an_emulated_arm_s_guards_bear_a_stall(stepped, name):
    """The twin of the test above: what trips there is the limits, not the stepped clock."""
    one = stepped(patient(RIG), "stirring", PATH.pose[0])
    act = {
        "a stall": lambda: one.clock.sleep(0.06),
        "a frozen link": lambda: one.emulator.network.freeze(0.06),
    }[name]
    one.when(Checked, lambda: one.orders.put(Follow(PATH)))
    one.when(Began, act, after=1.0)
    one.when(Done, lambda: one.orders.put(Leave()))
    assert one.run() == 0
