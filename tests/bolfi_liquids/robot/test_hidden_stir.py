"""What the emulated stick shows of a hidden liquid."""

import numpy as np
import pytest
from bolfi_liquids.hardware import StickMotion
from bolfi_liquids.hardware.motion import joined

import bolfi_liquids as bl
from bolfi_liquids import hardware, models
from bolfi_liquids.errors import InputError
from bolfi_liquids.robot.record import with_stir
from bolfi_liquids.robot.stir import plan_stir

RIG = hardware.bundled_rig()


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


def test_a_senseless_viscosity_is_refused_before_anything_starts():
    for viscosity in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(hardware.RigError, match="viscosity"):
            hardware.HiddenLiquid(viscosity=viscosity)


@pytest.mark.parametrize(
    ("liquid", "said"),
    [({"viscosity": 1e9}, "^emulated viscosity: 1000000000"), ({"seed": -1}, "^emulated seed: -1")],
)
def test_a_liquid_that_the_simulator_refuses_is_named_as_the_emulated_one(tmp_path, liquid, said):
    with pytest.raises(InputError, match=said):
        bl.record(RIG, out=tmp_path / "out", emulate=hardware.HiddenLiquid(**liquid))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("lost", [slice(None), slice(5, 6)])
def test_a_stir_that_cannot_be_simulated_is_refused_before_the_session(tmp_path, monkeypatch, lost):
    def fails(_liquid, gripper, _setup, seeds, _effects):
        angles = np.zeros((len(seeds), len(gripper.time), 2))
        angles[:, lost] = np.nan
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


def test_hidden_liquids_compare_by_what_they_are_and_not_by_their_table():
    still = StickMotion(np.arange(2.0), np.zeros((2, 3)), np.zeros((2, 2)))
    one, other = hardware.HiddenLiquid(stir=still), hardware.HiddenLiquid()
    assert one == other
    assert hash(one) == hash(other)
