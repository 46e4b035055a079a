"""The order in which the paths of a stir are followed and awaited."""

from functools import partial
from types import SimpleNamespace

import numpy as np
from bolfi_liquids.hardware import bundled_rig
from bolfi_liquids.hardware.motion import above_cup

from bolfi_liquids.online import record
from bolfi_liquids.robot.stir import PATHS_AHEAD, follow_plan, plan_stir

RIG = bundled_rig()
PLAN = plan_stir(RIG, 2)


class Session:
    """Keeps what was ordered; a path may be awaited once it was, in order."""

    rig = RIG

    def __init__(self):
        self.ordered, self.awaited = [], []

    def pose(self):
        return above_cup(RIG)

    def follow(self, path):
        assert len(self.ordered) - len(self.awaited) <= PATHS_AHEAD  # beyond the one that runs
        self.ordered.append(path)
        return len(self.ordered) - 1

    def wait(self, number, path):
        assert path is self.ordered[number]
        assert number == len(self.awaited)
        self.awaited.append(number)
        return False


def test_a_plan_is_followed_to_its_end():
    session = Session()
    follow_plan(session, PLAN, session.wait)
    assert session.ordered[1:] == list(PLAN.paths)
    assert len(session.awaited) == len(session.ordered)


def test_a_stir_that_is_enough_ends_with_a_rest_and_leaves_the_cup_from_there():
    session, strokes = Session(), list(PLAN.strokes)

    def enough_after_three(number, path):
        session.wait(number, path)
        return number >= 4  # the way to the cup, into it, and three strokes

    follow_plan(session, PLAN, enough_after_three)
    _, insert, *stirred, still, out = session.ordered
    assert insert is PLAN.insert
    assert stirred == strokes[: 3 + PATHS_AHEAD]
    last = stirred[-1].pose[-1]
    assert still.stirring and still.time[-1] >= RIG.stirring.rest - 2.0 / RIG.robot.rate
    np.testing.assert_array_equal(still.pose, np.tile(last, (len(still.time), 1)))
    np.testing.assert_allclose(out.pose[0, :3], last[:3], atol=1e-9)
    assert out.pose[-1, 2] > RIG.cup.height
    assert len(session.awaited) == len(session.ordered)


def test_what_is_enough_at_the_last_stroke_changes_nothing():
    session = Session()

    def enough(number, path):
        session.wait(number, path)
        return number >= len(PLAN.strokes) - 1

    follow_plan(session, PLAN, enough)
    assert session.ordered[1:] == list(PLAN.paths)


def test_data_are_handed_over_after_strokes_alone(monkeypatch):
    class Done(Session):
        directory = None

        def wait(self, number, timeout):
            return not super().wait(number, self.ordered[number])

    handed, session = [], Done()
    monkeypatch.setattr(record, "FOLLOWED_AFTER", 0.0)
    monkeypatch.setattr(record, "_so_far", lambda *_: len(session.ordered))
    calibration = SimpleNamespace(update=handed.append, phase="ready", detail="")
    view = SimpleNamespace(session=session, show=lambda: None)
    follow_plan(session, PLAN, partial(record.Learning(calibration).wait, view))
    assert len(handed) == len(PLAN.strokes)
