from importlib.resources import files

import numpy as np
import pytest
from scipy.stats import spearmanr

from bolfi_liquids import models

# angular velocity [deg/s], distance [cm], spilled fraction: pours by an independent solver
# (SPlisHSPlasH 2.19, DFSPH) in the bundled cups
POURS = {
    "glycerin": (1.0, 1260.0, [(30, 1.0, 0.053), (45, 6.0, 0.943), (90, 2.0, 0.036),
                               (90, 4.5, 0.270), (180, 2.0, 0.039), (180, 6.0, 0.328)]),
    "oil": (0.1, 900.0, [(30, 2.0, 0.008), (45, 1.0, 0.310), (90, 1.0, 0.696),
                         (90, 3.0, 0.078), (180, 2.0, 0.649), (180, 4.5, 0.047)]),
    "water": (0.001, 1000.0, [(30, 1.0, 0.456), (45, 4.5, 0.002), (90, 1.0, 0.920),
                              (90, 4.5, 0.023), (180, 3.0, 0.708), (180, 6.0, 0.063)]),
}  # fmt: skip


def pour(liquid, rows, cups, seeds=None):
    viscosity, density = liquid
    rate, distance = np.array(rows, dtype=float)[:, :2].T
    action = models.PourAction(np.radians(rate), distance / 100.0)
    seeds = np.zeros(len(rows), int) if seeds is None else seeds
    return models.pour(models.Liquid(viscosity, 0.0, density), action, cups, seeds)


@pytest.mark.slow
def test_spillage_ranks_pours_as_an_independent_solver_does(cups):
    ours, theirs = [], []
    for viscosity, density, rows in POURS.values():
        ours.append(pour((viscosity, density), rows, cups).spilled)
        theirs.append([row[2] for row in rows])
    ours, theirs = np.concatenate(ours), np.concatenate(theirs)
    assert spearmanr(ours, theirs).statistic > 0.8
    assert np.sqrt(np.mean((ours - theirs) ** 2)) < 0.15


@pytest.mark.slow
def test_every_particle_is_somewhere(cups):
    rows = [(30, 0.0), (60, 7.0), (180, 3.0), (120, 2.0)]
    result = pour(([1e-3, 0.1, 1.0, 50.0], 1000.0), rows, cups)
    counts = 664 * np.stack([result.spilled, result.received, result.retained])
    assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert (np.round(counts).sum(axis=0) == 664).all()
    assert result.retained[2] > result.retained[0]


@pytest.mark.slow
def test_same_bits_again_and_anywhere_in_a_batch(cups):
    rows = [(180, 1.0), (120, 2.0), (150, 3.0)]
    seeds = np.array([1, 2, 3])
    whole = pour((0.01, 1000.0), rows, cups, seeds)
    again = pour((0.01, 1000.0), rows[::-1], cups, seeds[::-1])
    alone = pour((0.01, 1000.0), rows[1:2], cups, seeds[1:2])
    np.testing.assert_array_equal(whole.spilled, again.spilled[::-1])
    np.testing.assert_array_equal(whole.received[1:2], alone.received)


@pytest.mark.minutes
def test_a_tilt_short_of_the_surface_spills_nothing(cups):
    gentle = cups.model_copy(
        update={"pour": cups.pour.model_copy(update={"final_angle_deg": 15.0})}
    )
    result = pour((0.01, 1000.0), [(30, 2.0)], gentle)
    assert result.retained == pytest.approx(1.0)


@pytest.mark.slow
def test_walls_hold_a_viscous_liquid_back(cups):
    """Free slip lets it go; walls that rub keep a film (the paper's glycerin). What is much
    thicker slips: the gel's plug leaves the cup, as it does in the other solver."""
    viscosity = (0.01, 1.0, 30.0)
    thin, thick, stiff = pour((viscosity, 1260.0), [(180, 2.0)] * 3, cups).retained
    assert thin == 0.0
    assert thick > 0.05
    assert stiff < 0.5 * thick


def test_bad_actions_are_named(cups):
    liquid = models.Liquid(1.0, 0.0, 1000.0)
    with pytest.raises(ValueError, match="angular_velocity must be positive"):
        models.pour(liquid, models.PourAction(0.0, 0.02), cups, [0])
    with pytest.raises(ValueError, match="angular_velocity must be 0.01 to 30.0 rad/s, got 90"):
        models.pour(liquid, models.PourAction(90.0, 0.02), cups, [0])
    with pytest.raises(ValueError, match="particles must be .* positive, got 0"):
        models.pour(liquid, models.PourAction(1.0, 0.02), cups, [0], particles=0)
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
        ("[0.0, 0.07]", "[-50.0, 0.07]", "-50 m looks like millimetres"),
        ("hold = 0.9 ", "hold = inf ", r"pour\.hold.*inf"),
        ("radius = 0.028", "radius = inf", r"source\.radius.*inf"),
        ("radius = 0.028", "radius = 0.56", r"source\.radius.*0.56 m looks like centimetres"),
        ("radius = 0.028", "radius = 28.0", r"source\.radius.*28 m looks like millimetres"),
        ("radius = 0.028", "radius = nan", r"source\.radius.*nan"),
        ("radius = 0.028", "radius = true", r"source\.radius.*True"),
        ("radius = 0.028", "radius = '0.028'", r"source\.radius.*'0.028'"),
        ("[0.0, 0.07]", "[-5.0, 0.07]", r"pour\.distance.*-5 m looks like centimetres"),
        ("[0.0, 0.07]", "[0.0, 70.0]", r"pour\.distance.*70 m looks like millimetres"),
        ("135.0", "nan", r"pour\.final_angle_deg.*nan"),
        ("hold = 0.9 ", "hold = nan ", r"pour\.hold.*nan"),
        ("135.0", "720.0", r"pour\.final_angle_deg.*720"),
        ("_deg = 60.0", "_deg = -1.0", r"source\.contact_angle_deg.*-1"),
        ("_deg = 60.0", "_deg = 180.5", r"source\.contact_angle_deg.*180.5"),
        ("_deg = 60.0", "_deg = nan", r"source\.contact_angle_deg.*nan"),
        ("_deg = 60.0", "_deg = '60'", r"source\.contact_angle_deg.*'60'"),
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


@pytest.mark.parametrize("degrees", [0.0, 110.0, 180.0])
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


def bundled_text():
    return (files("bolfi_liquids.data") / "cups.toml").read_text()


def test_a_cups_file_may_begin_with_a_byte_order_mark(tmp_path, cups):
    (tmp_path / "cups.toml").write_text(bundled_text(), encoding="utf-8-sig")
    assert models.Cups.from_toml(tmp_path / "cups.toml") == cups


def test_landings_serve_every_receiver(cups):
    """One simulation tells what any distance and radius would have caught."""
    liquid, rate, seeds = models.Liquid([0.01, 1.0], 0.0, 1000.0), 2.5, [0, 1]
    landings = models.landings(liquid, rate, cups, seeds)
    for distance in (0.01, 0.045):
        whole = models.pour(liquid, models.PourAction(rate, distance), cups, seeds)
        caught = landings.into(distance, cups.receiver.radius)
        np.testing.assert_array_equal(whole.received, caught.received)
    many = landings.into(np.linspace(0.0, 0.07, 8)[:, None], cups.receiver.radius)
    assert many.spilled.shape == (8, 2)
    wide = landings.into(0.03, 1.0)  # what flies when the pour ends is in no receiver
    flying = np.isnan(landings.position).any(axis=-1).mean(axis=1) - landings.retained
    assert wide.spilled == pytest.approx(flying, abs=1e-9)
    assert wide.spilled + wide.retained + wide.received == pytest.approx(1.0)
    np.testing.assert_array_equal(landings.into(0.03, 0.0).received, 0.0)
