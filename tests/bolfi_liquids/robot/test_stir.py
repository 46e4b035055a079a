"""A stir is planned within limits, simulated for an emulated arm, and followed in order."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import above_cup, joined

import bolfi_liquids as bl
from bolfi_liquids import hardware, models
from bolfi_liquids.errors import InputError
from bolfi_liquids.online import record
from bolfi_liquids.robot.record import with_stir
from bolfi_liquids.robot.stir import PATHS_AHEAD, follow_plan, plan_stir

RIG = hardware.bundled_rig()
PLAN = plan_stir(RIG, 2)
CIRCLE = RIG.stirring.model_copy(update={"pattern": "circle"})
CIRCLES = plan_stir(RIG.model_copy(update={"stirring": CIRCLE}), 8)


class Session:
    """Keeps what was ordered; a path may be awaited once it was, in order."""

    rig = RIG

    def __init__(self):
        self.ordered, self.awaited = [], []

    def pose(self):
        return above_cup(RIG)

    def follow(self, path):
        assert len(self.ordered) - len(self.awaited) <= 2  # beyond the one that runs
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


@pytest.mark.parametrize("plan", [PLAN, CIRCLES])
def test_a_stir_that_is_enough_ends_with_a_rest_and_leaves_the_cup_from_there(plan):
    session, strokes = Session(), list(plan.strokes)

    def enough_after_three(number, path):
        session.wait(number, path)
        return number >= 4  # the way to the cup, into it, and three strokes

    follow_plan(session, plan, enough_after_three)
    _, insert, *stirred, still, out = session.ordered
    assert insert is plan.insert
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


@pytest.mark.parametrize(
    ("rest", "cycles", "where"),
    [(2.0, 0, "cycles"), (2.0, 101, "cycles"), (0.2, None, "rig: stirring.rest")],
)
def test_a_stir_that_is_too_short_or_too_long_is_not_planned(rest, cycles, where):
    stirring = RIG.stirring.model_copy(update={"rest": rest})
    with pytest.raises(InputError) as refused:
        plan_stir(RIG.model_copy(update={"stirring": stirring}), cycles)
    assert refused.value.where == where


@pytest.mark.slow
def test_a_hidden_liquid_shows_its_own_stir_on_the_way_of_the_arm():
    plan = plan_stir(RIG)
    thin, thick = (
        with_stir(RIG, plan, hardware.HiddenLiquid(viscosity=viscosity)) for viscosity in (0.1, 3.0)
    )
    assert thin.viscosity == 0.1 and thin.stir is not None and thick.stir is not None
    time, pivot, inclination = thin.stir
    way = joined(list(plan.strokes))
    np.testing.assert_array_equal(time, way.time)
    assert 5e-3 < np.linalg.norm(pivot - way.pose[:, :3], axis=1).max() < 2e-2
    begins = np.flatnonzero(np.linalg.norm(pivot - pivot[0], axis=1) > 1e-4)[0]
    assert np.abs(inclination[:begins]).max() < np.radians(0.1)
    assert 3.0 < np.degrees(np.abs(inclination).max()) < 30.0
    assert np.degrees(np.abs(inclination - thick.stir.inclination).max()) > 1.0


def test_a_liquid_that_cannot_be_emulated_is_named_before_anything_starts(tmp_path):
    rows = (
        ({"viscosity": np.nan}, "viscosity"),
        ({"viscosity": 1e9}, "emulated viscosity"),
        ({"seed": -1}, "emulated seed"),
    )
    for liquid, where in rows:
        with pytest.raises((InputError, hardware.RigError)) as refused:
            bl.record(RIG, out=tmp_path / "out", emulate=hardware.HiddenLiquid(**liquid))
        assert where in refused.value.where
    assert not (tmp_path / "out").exists()


def test_a_stir_that_cannot_be_simulated_is_refused_before_the_session(tmp_path, monkeypatch):
    def fails(_liquid, gripper, _setup, seeds, _effects):
        angles = np.zeros((len(seeds), len(gripper.time), 2))
        angles[:, 5] = np.nan
        return angles

    monkeypatch.setattr(models, "stir", fails)
    with pytest.raises(InputError, match=r"^emulated viscosity: 1e\+06 Pa s"):
        bl.record(RIG, out=tmp_path / "out", emulate=hardware.HiddenLiquid(viscosity=1e6))
    assert not (tmp_path / "out").exists()


def test_a_directory_that_holds_something_is_refused_before_the_stir_is_simulated(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(models, "stir", lambda *_: pytest.fail("simulated"))
    (tmp_path / "mine.txt").write_text("kept")
    with pytest.raises(hardware.RigError, match=r"mine\.txt"):
        bl.record(RIG, out=tmp_path, emulate=True)
