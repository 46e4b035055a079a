from importlib.resources import files

import numpy as np
import pytest

from bolfi_liquids import models


def test_bad_actions_are_named(cups):
    liquid = models.Liquid(1.0, 0.0, 1000.0)
    with pytest.raises(ValueError, match="angular_velocity must be positive"):
        models.pour(liquid, models.PourAction(0.0, 0.02), cups, [0])
    with pytest.raises(ValueError, match="angular_velocity must be 0.01 to 30.0 rad/s, got 90"):
        models.pour(liquid, models.PourAction(90.0, 0.02), cups, [0])
    with pytest.raises(ValueError, match="particles must be .* not negative, got -1"):
        models.pour(liquid, models.PourAction(1.0, 0.02), cups, [0], particles=-1)
    with pytest.raises(ValueError, match="distance must be finite"):
        models.pour(liquid, models.PourAction(1.0, np.inf), cups, [0])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("radius = 0.028", "radius = -0.028", r"source\.radius.*-0\.028"),
        ("radius = 0.028", "diameter = 0.056", r"source\.(radius|diameter)"),
        ("hold = 0.9 ", "hold = 'long' ", r"pour\.hold.*long"),
        ("lip_height = 0.20", "lip_height = 0.05", "lip.*not above the receiver's rim"),
        ("[0.0, 0.07]", "[0.07, 0.0]", "distance must ascend"),
        ("[30.0, 180.0]", "[1.0, 3.14]", r"angular_velocity_deg_s.*3\.14.*no rad/s"),
        ("[0.0, 0.07]", "[-50.0, 0.07]", "0.5 m, got -50"),
        ("radius = 0.028", "radius = inf", r"source\.radius.*inf"),
        ("radius = 0.028", "radius = 0.56", r"source\.radius.*0.25 m, got 0.56"),
        ("radius = 0.028", "radius = 28.0", r"source\.radius.*0.25 m, got 28"),
        ("radius = 0.028", "radius = true", r"source\.radius.*True"),
        ("135.0", "720.0", r"pour\.final_angle_deg.*720"),
        (
            "[30.0, 180.0]",
            "[30.0, 1720.0]",
            r"angular_velocity_deg_s\.1: .* 1718.9 deg/s, got 1720",
        ),
        ("[30.0, 180.0]", "[0.57, 180.0]", r"angular_velocity_deg_s\.0: .*0.573 to .*, got 0.57"),
        ("_deg = 60.0", "_deg = -1.0", r"source\.contact_angle_deg.*-1"),
        ("_deg = 60.0", "_deg = 180.5", r"source\.contact_angle_deg.*180.5"),
        ("[source]", "[source", "not a TOML file"),
    ],
)
def test_bad_cups_files_are_named(tmp_path, old, new, message):
    text = bundled_text()
    assert old in text
    path = tmp_path / "cups.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError, match=f"cups.toml.*{message}"):
        models.Cups.from_toml(path)


@pytest.mark.parametrize("degrees", [0.0, 110.0])
def test_a_contact_angle_is_read_in_degrees_and_given_in_radians(tmp_path, cups, degrees):
    path = tmp_path / "cups.toml"
    path.write_text(bundled_text().replace("_deg = 60.0", f"_deg = {degrees}", 1))
    wetted = models.Cups.from_toml(path)
    assert wetted.contact_angle == pytest.approx(np.pi * degrees / 180.0)
    assert wetted.settings() != cups.settings()  # so that no pour of another angle is reused


def test_cups_without_a_contact_angle_are_taken_at_60_degrees(tmp_path, cups):
    line = next(one for one in bundled_text().splitlines() if one.startswith("contact_angle"))
    path = tmp_path / "cups.toml"
    path.write_text(bundled_text().replace(line, ""))
    assert models.Cups.from_toml(path).contact_angle == pytest.approx(np.pi / 3.0)


def test_every_angular_velocity_of_a_cups_file_is_one_that_pours_take(tmp_path):
    path = tmp_path / "cups.toml"
    path.write_text(bundled_text().replace("[30.0, 180.0]", "[0.573, 1718.8]", 1))
    cups, liquid = models.Cups.from_toml(path), models.Liquid(1.0, 0.0, 1000.0)
    for rate in cups.angular_velocity_range:
        with pytest.raises(ValueError, match="particles"):  # nothing is wrong with the rate
            models.landings(liquid, rate, cups, [0], -1)


def bundled_text():
    return (files("bolfi_liquids.data") / "cups.toml").read_text()


def test_a_cups_file_may_begin_with_a_byte_order_mark(tmp_path, cups):
    (tmp_path / "cups.toml").write_text(bundled_text(), encoding="utf-8-sig")
    assert models.Cups.from_toml(tmp_path / "cups.toml") == cups


@pytest.mark.slow
def test_landings_serve_every_receiver(cups):
    """One simulation tells what any distance and radius would have caught."""
    liquid, rate, seeds = models.Liquid([0.01, 1.0], 0.0, 1000.0), 2.5, [0, 1]
    landings = models.landings(liquid, rate, cups, seeds, 900)
    for distance in (0.01, 0.045):
        action = models.PourAction(rate, distance)
        whole = models.pour(liquid, action, cups, seeds, 900)
        caught = landings.into(distance, cups.receiver.radius)
        np.testing.assert_array_equal(whole.received, caught.received)
    many = landings.into(np.linspace(0.0, 0.07, 8)[:, None], cups.receiver.radius)
    assert many.spilled.shape == (8, 2)
    wide = landings.into(0.03, 1.0)
    np.testing.assert_allclose(wide.spilled, 0.0, atol=1e-12)  # all that left lands somewhere
    np.testing.assert_allclose(wide.retained + wide.received, 1.0)
    np.testing.assert_array_equal(landings.into(0.03, 0.0).received, 0.0)
