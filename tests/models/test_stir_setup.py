"""A setup that cannot be is refused, by the name of the number that is wrong."""

from types import SimpleNamespace

import numpy as np
import pytest

from bolfi_liquids import models

CUP = {"radius": 0.04, "height": 0.075, "fill": 0.05}
STICK = {"radius": 0.0045, "length": 0.22, "mass": 0.0168}
TIME = np.arange(5) / 30.0
POSITION = np.tile([0.0, 0.0, 0.235], (5, 1))


@pytest.mark.parametrize(
    ("cup", "stick", "particles", "message"),
    [
        ({"fill": 0.09}, {}, 100, r"fill 0\.09 m is more than its height 0\.075 m"),
        ({"radius": np.nan}, {}, 100, "cup: radius must be a number, finite and positive, got nan"),
        ({}, {"mass": 0.0}, 100, "stick: mass must be a number, finite and positive, got 0.0"),
        ({}, {"radius": 0.05}, 100, r"of radius 0\.05 m, does not fit into the cup"),
        ({}, {}, -1, "setup: particles must be a number, finite and not negative, got -1"),
        ({}, {}, 100.5, "particles must be a whole number, got 100.5"),
        ({}, {}, "many", "particles must be a number, finite and not negative, got 'many'"),
    ],
)
def test_what_cannot_be_is_named(cup, stick, particles, message):
    with pytest.raises(ValueError, match=message):
        models.StirSetup(
            models.Cup(**CUP | cup), models.Stick(**STICK | stick), 0.035, particles=particles
        )


@pytest.mark.parametrize(
    ("name", "value"), [("cell", 0.0), ("longest_step", -1.0), ("courant", np.inf)]
)
def test_numerics_are_positive_and_finite(name, value):
    with pytest.raises(ValueError, match=f"numerics: {name} must be"):
        models.Numerics(**{name: value})


@pytest.mark.parametrize(
    ("time", "position", "message"),
    [
        (TIME[::-1], POSITION, "times must rise"),
        (TIME, POSITION[:, :2], r"shape \(5, 2\); give shape \(5, 3\)"),
        (TIME, 1e3 * POSITION, "path must be finite and within 10 m, got 235$"),
    ],
)
def test_a_path_that_cannot_be_is_refused(time, position, message):
    setup = models.StirSetup(models.Cup(**CUP), models.Stick(**STICK), 0.035, particles=100)
    path = SimpleNamespace(time=time, position=position)
    with pytest.raises(ValueError, match=message):
        models.stir(models.Liquid(0.1, 0.0, 1000.0), path, setup, [0])


def test_a_liquid_s_field_is_named():
    with pytest.raises(ValueError, match="viscosity must be a number or an array, got 'honey'"):
        models.Liquid("honey", 0.0, 1000.0).batch(1)
