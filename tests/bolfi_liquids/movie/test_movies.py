from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from PIL import Image
from typer.testing import CliRunner

from bolfi_liquids import models
from bolfi_liquids.cli.app import app
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.movie.file import write_movie
from bolfi_liquids.movie.pour import (
    GRAVITY,
    landed,
    level,
    pour_pictures,
    pour_view,
    receiver_glass,
    source_glass,
)
from bolfi_liquids.movie.rendering import Glass, OrthographicView, surface
from bolfi_liquids.movie.stir import stir_pictures, stir_view

UP = np.array([0.0, 0.0, 1.0])
FAR = Glass(0.01, 0.01, np.array([9.0, 9.0, 9.0]), UP)  # holds nothing of what is drawn
FRONT = OrthographicView(161, 121, 1000.0, (0.0, 0.0, 0.0), 0.0, 0.0)
SPACING = 0.005


def shown(points, glass):
    """What each pixel of a picture from the front shows of the liquid, arrays of its shape."""
    seen = surface(FRONT, points, SPACING, glass)
    whole = {
        name: np.zeros((FRONT.height, FRONT.width, *field.shape[2:]))
        for name, field in seen._asdict().items()
        if name != "window"
    }
    for name, field in whole.items():
        field[seen.window] = getattr(seen, name)
    return SimpleNamespace(**whole)


def lattice(low, high):
    """Particles that fill a box [m]."""
    axes = (np.arange(a + SPACING / 2, b, SPACING) for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.fixture(scope="module")
def cups():
    return bundled_cups()


@pytest.fixture(scope="module")
def setup():
    return models.StirSetup(models.Cup(0.04, 0.075, 0.05), models.Stick(0.0045, 0.22, 0.02), 0.035)


def test_points_are_where_an_orthographic_camera_sees_them():
    """From the front; from the side; from above: written down by hand."""
    view = OrthographicView(201, 101, 500.0, (0.1, 0.2, 0.3), 0.0, 0.0)
    point = np.array([0.1 + 0.02, 0.2 + 0.03, 0.3 + 0.04])
    assert view.pixels(point) == pytest.approx([100.0 + 10.0, 50.0 - 20.0])
    side = OrthographicView(201, 101, 500.0, (0.1, 0.2, 0.3), np.pi / 2.0, 0.0)
    assert side.pixels(point) == pytest.approx([100.0 + 15.0, 50.0 - 20.0])
    above = OrthographicView(201, 101, 500.0, (0.1, 0.2, 0.3), 0.0, np.pi / 2.0)
    assert above.pixels(point) == pytest.approx([100.0 + 10.0, 50.0 - 15.0])
    tilted = OrthographicView(201, 101, 500.0, (0.1, 0.2, 0.3), 0.0, np.radians(30.0))
    up = 0.04 * np.cos(np.radians(30.0)) + 0.03 * np.sin(np.radians(30.0))
    assert tilted.pixels(point) == pytest.approx([110.0, 50.0 - 500.0 * up])
    assert tilted.axes @ tilted.axes.T == pytest.approx(np.eye(3))
    assert tilted.camera(point - [0.0, 0.1, 0.0])[2] > tilted.camera(point)[2]


def test_a_drop_is_a_disc_of_about_its_own_volume_where_it_is():
    seen = shown(np.array([[0.02, 0.0, -0.01]]), FAR)
    rows, columns = np.indices(seen.cover.shape)
    total = seen.cover.sum()
    assert (seen.cover * columns).sum() / total == pytest.approx(80.0 + 20.0, abs=0.5)
    assert (seen.cover * rows).sum() / total == pytest.approx(60.0 + 10.0, abs=0.5)
    radius = (3.0 * SPACING**3 / (4.0 * np.pi)) ** (1.0 / 3.0)
    assert np.sqrt(total / np.pi) / 1000.0 == pytest.approx(radius, rel=0.1)


def test_a_block_is_as_thick_and_as_near_as_it_is():
    seen = shown(lattice((-0.03, -0.02, -0.03), (0.03, 0.02, 0.03)), FAR)
    assert seen.cover[60, 80] == 1.0
    assert seen.thickness[60, 80] == pytest.approx(0.04, rel=0.1)
    assert seen.front[60, 80] == pytest.approx(0.02, abs=0.15 * SPACING)
    assert seen.normal[60, 80] == pytest.approx([0.0, 0.0, 1.0], abs=0.05)
    assert seen.cover.sum() / 1000.0**2 == pytest.approx(0.06**2, rel=0.08)


def test_liquid_ends_at_the_glass_and_at_its_level():
    """A full cylinder from the front is a rectangle: twice its radius wide, as high as its fill."""
    glass = Glass(0.03, 0.06, np.array([0.0, 0.0, -0.03]), UP)
    points = lattice((-0.03, -0.03, -0.03), (0.03, 0.03, 0.01))
    points = points[np.hypot(points[:, 0], points[:, 1]) < 0.03 - SPACING / 3]
    seen = shown(points, glass)
    middle = seen.cover[70]  # a row half-way up the liquid
    assert middle.sum() / 1000.0 == pytest.approx(0.06, abs=0.002)
    column = seen.cover[:, 80]
    assert column.sum() / 1000.0 == pytest.approx(0.04, abs=0.3 * SPACING)
    assert column[91:].sum() == pytest.approx(0.0, abs=0.5)  # nothing below the floor
    assert surface(FRONT, np.empty((0, 3)), SPACING, glass) is None


def test_a_blob_that_turns_turns_in_the_pictures():
    block = lattice((0.02, -0.005, -0.005), (0.03, 0.005, 0.005))
    for angle in np.radians([0.0, 40.0, 130.0, 250.0]):
        c, s = np.cos(angle), np.sin(angle)
        turned = block @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        cover = shown(turned, FAR).cover
        rows, columns = np.indices(cover.shape)
        at = (cover * columns).sum() / cover.sum(), (cover * rows).sum() / cover.sum()
        assert at == pytest.approx([80.0 + 25.0 * c, 60.0 - 25.0 * s], abs=0.7)


def test_the_receiver_s_level_is_its_share_of_the_liquid(cups):
    share, distance = 0.4, 0.03
    rng = np.random.default_rng(0)
    inside = distance + 0.3 * cups.receiver.radius * rng.uniform(-1, 1, (40, 2)) * [1, 0]
    inside[:, 1] = 0.0
    spots = np.concatenate([inside, np.full((60, 2), 0.2)])
    now = landed(models.Landings(spots[None], np.zeros(1)), 100, 100, 0.04, cups, distance)
    assert now.caught == pytest.approx(share)
    volume = level(now.caught, cups) * np.pi * cups.receiver.radius**2
    assert volume == pytest.approx(share * cups.liquid_volume)
    assert len(now.spilled) == 60 and len(now.falling) == 0
    assert level(1e3, cups) == cups.receiver.height


def test_what_passed_the_rim_falls_on_as_stones_do(cups):
    """One that passed it half an interval ago, beside the receiver."""
    interval, drop = 0.02, cups.pour.lip_height - cups.receiver.height
    one = models.Landings(np.array([[[0.1, 0.01]]]), np.zeros(1))
    now = landed(one, 0, 1, interval, cups, 0.0)
    until_rim = np.sqrt(2.0 * drop / GRAVITY)
    fallen = GRAVITY * (until_rim + interval / 2.0) ** 2 / 2.0
    ahead = 0.1 * (until_rim + interval / 2.0) / until_rim
    assert now.falling == pytest.approx(np.array([[ahead, 0.01, -fallen]]))
    assert now.caught == 0.0 and len(now.spilled) == 0


def test_a_cup_turns_about_its_lip(cups):
    for angle in (0.0, 1.0, cups.pour.final_angle):
        glass = source_glass(cups, angle)
        lip = glass.floor + glass.height * glass.axis
        assert np.linalg.norm(lip) == pytest.approx(glass.radius, abs=1e-12)
        assert lip @ glass.axis == pytest.approx(0.0, abs=1e-12)
    assert source_glass(cups, np.pi / 2.0).axis == pytest.approx([1.0, 0.0, 0.0])


def test_all_that_matters_is_in_the_picture(cups, setup):
    for distance in (0.0, 0.07):
        view, receiver = pour_view(cups, distance), receiver_glass(cups, distance)
        glasses = [source_glass(cups, a) for a in np.linspace(0.0, 2.4, 9)] + [receiver]
        for glass in glasses:
            ends = [glass.floor, glass.floor + glass.height * glass.axis]
            at = view.pixels(np.array(ends))
            assert (at > 0.0).all() and (at < [view.width - 1, view.height - 1]).all()
    view = stir_view(setup)
    corners = 0.04 * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    for height in (0.0, 0.075):
        at = view.pixels(corners + [0.0, 0.0, height])
        assert (at > 0.0).all() and (at < [view.width - 1, view.height - 1]).all()


def test_pictures_of_a_stir_show_the_liquid_where_it_is(setup):
    """Half a cup of liquid on the right, then on the left: blue changes sides."""
    points = lattice((-0.04, -0.04, 0.0), (0.04, 0.04, 0.05))
    points = points[np.hypot(points[:, 0], points[:, 1]) < 0.038]
    right = stir_view(setup).axes[0]
    halves = [points[side * (points @ right) > 0.0] for side in (1.0, -1.0)]
    count = min(map(len, halves))
    frames = models.StirFrames(
        time=np.array([0.0, 0.04]),
        position=np.stack([half[:count] for half in halves]),
        pivot=np.tile([0.0, 0.0, 0.235], (2, 1)),
        tip=np.tile([0.0, 0.0, 0.1], (2, 1)),
        inclination=np.zeros((2, 2)),
    )
    pictures = list(stir_pictures(frames, setup, ["a liquid"]))
    assert all(p.shape == (480, 640, 3) and p.dtype == np.uint8 for p in pictures)
    row = int(stir_view(setup).pixels(np.array([0.0, 0.0, 0.02]))[1])
    for picture, sides in zip(pictures, (1, -1), strict=True):
        line = picture[row].astype(int)
        blue = np.flatnonzero(line[:, 2] - line[:, 0] > 70) - 320
        assert len(blue) > 50 and np.mean(sides * blue > 0) > 0.9


def test_pictures_of_a_pour_show_what_was_received(cups):
    """All of the liquid caught, against nothing: the receiver turns blue up to its level."""
    count, distance = 200, 0.03
    position = np.full((3, count, 3), np.nan, np.float32)
    position[0] = lattice((-0.04, -0.01, -0.05), (-0.01, 0.02, 0.0))[:count]
    spots = np.tile([[distance, 0.0]], (1, count, 1)).astype(np.float32)
    landings = models.Landings(spots, np.zeros(1))
    frames = models.PourFrames(np.arange(3.0), position, np.array([0.0, 1.5, 1.5]), landings)
    empty, _, full = pour_pictures(frames, cups, distance, ["a liquid"])
    view, glass = pour_view(cups, distance), receiver_glass(cups, distance)
    changed = np.abs(full.astype(int) - empty.astype(int)).sum(axis=-1) > 60
    column = int(view.pixels(glass.floor)[0])
    rows = np.flatnonzero(changed[400:, column]) + 400
    # from the near edge of the floor to the far edge of the surface
    edge = cups.receiver.radius * np.sin(view.elevation)
    depth = level(1.0, cups) * np.cos(view.elevation) + 2.0 * edge
    assert np.ptp(rows) / view.scale == pytest.approx(depth, rel=0.05)


def moving_square(count):
    for at in range(count):
        picture = np.full((48, 64, 3), 230, np.uint8)
        picture[10:30, 3 * at : 3 * at + 15] = (30, 90, 200)
        yield picture


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_animations_have_their_frames_size_and_rate(tmp_path, suffix):
    path = write_movie(tmp_path / f"a{suffix}", moving_square(7), 25.0)
    with Image.open(path) as image:
        assert (image.n_frames, image.size) == (7, (64, 48))
        image.seek(3)
        shown = np.asarray(image.convert("RGB")).astype(int)
        assert image.info["duration"] == 40
    assert edges(shown) == pytest.approx([9, 23], abs=1)


def edges(picture):
    """First and last column of the blue square."""
    square = np.flatnonzero(picture[20, :, 2] - picture[20, :, 0] > 80)
    return [square.min(), square.max()]


def test_an_mp4_has_its_frames_size_and_rate(tmp_path):
    av = pytest.importorskip("av")
    path = write_movie(tmp_path / "a.mp4", moving_square(7), 25.0)
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        assert (stream.width, stream.height, stream.average_rate) == (64, 48, 25)
        shown = [frame.to_ndarray(format="rgb24").astype(int) for frame in file.decode(stream)]
    assert len(shown) == 7
    assert edges(shown[3]) == pytest.approx([9, 23], abs=2)


@pytest.mark.parametrize("suffix", [".mp4", ".webp"])
def test_a_film_that_breaks_leaves_the_old_one(tmp_path, suffix):
    def broken():
        yield from moving_square(2)
        raise KeyboardInterrupt

    (tmp_path / f"a{suffix}").write_text("old")
    with pytest.raises(KeyboardInterrupt):
        write_movie(tmp_path / f"a{suffix}", broken())
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [(f"a{suffix}", "old")]


@pytest.mark.slow
def test_commands_simulate_film_and_write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    few = ["--particles", "120", "--viscosity", "0.1"]
    stirred = CliRunner().invoke(
        app, ["simulate", "stir", *few, "--out", "a.nc", "--movie", "a.webp", *_short(tmp_path)]
    )
    assert stirred.exit_code == 0, stirred.stderr
    again = open_recording("a.nc")
    largest = np.degrees(np.abs(again.inclination).max(axis=0))
    said = f"largest inclination: {largest[0]:.2f} deg in xz, {largest[1]:.2f} deg in yz"
    assert said in stirred.stdout and "movie: a.webp" in stirred.stdout
    with Image.open("a.webp") as movie:
        assert movie.size == (640, 480)
        seconds = again.time[-1] - again.time[0]
        assert movie.n_frames == pytest.approx(25.0 * seconds, abs=2)

    poured = CliRunner().invoke(app, ["simulate", "pour", *few, "--out", "b.nc"])
    assert poured.exit_code == 0, poured.stderr
    with xr.open_dataset("b.nc") as written:
        shares = [float(written[name]) for name in ("spilled", "received", "retained")]
    assert sum(shares) == pytest.approx(1.0)
    assert f"spilled {shares[0]:.1%}, received {shares[1]:.1%}" in poured.stdout


def _short(tmp_path):
    """Options for the first two seconds of the bundled glycerin."""
    with xr.open_dataset(bundled_recording("glycerin").path, decode_times=False) as whole:
        whole.isel(time=slice(0, 90)).to_netcdf(tmp_path / "short.nc", engine="h5netcdf")
    return ["--recording", "short.nc"]
