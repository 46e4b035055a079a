"""Make a recording of a stir by the Navier-Stokes reference, with or without a hidden effect.

    .venv/bin/python tests/benchmarks/reference/make_reference_stirs.py honey.nc \\
        --viscosity 6 --density 1400 --cell-mm 2.1 --step-ms 0.4
    .venv/bin/python tests/benchmarks/reference/make_reference_stirs.py rubbing.nc \\
        --viscosity 0.1 --density 920 --rest 2 --dry-friction 3e-4 \\
        --true-fill-cm 5.02 --tilt-deg 0.1 -0.2

The path is a star, or a circle with `--turns`, or straight strokes along `--corners-cm`. The file
has the form of a recorded stir (`bolfi-liquids guide recordings`), 30 samples a second with
Gaussian noise, and is opened once to see that it can be used. What is hidden acts on the stir and
is not written in the file; note it elsewhere. Take cells of 1.5 mm up to 0.05 Pa s and of 2.1 mm
above, and steps of 1 ms up to 3 Pa s and of 0.4 ms above; 7 s of stirring in cells of 2.1 mm
and steps of 1 ms take some two minutes of one processor.
"""

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline
from stirring_reference import (
    GripperPath,
    Liquid,
    Motion,
    Resolution,
    Stir,
    StirScene,
    circle,
    polygon,
    reference_stir,
    star,
)

from bolfi_liquids.files import new_file, write_netcdf
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.inputs.recording import AXES, PLANES, recording_dataset

if TYPE_CHECKING:
    from xarray import Dataset

FRAMES_A_SECOND = 30.0
CENTIMETRE = 0.01


def main(arguments: list[str] | None = None) -> Path:
    """Make one recording; the file that was written."""
    given = _parser().parse_args(arguments)
    out = new_file(given.out, "OUT", suffix=".nc")
    path, scene = _path(given), _scene(given)
    liquid = Liquid(given.viscosity, given.density, given.warming)
    resolution = Resolution(given.cell_mm * 1e-3, given.step_ms * 1e-3)
    true_path = scaled(path, 1.0 / given.path_scale)
    stir = reference_stir(scene, liquid, true_path, resolution, progress=_show)
    print(file=sys.stderr)
    values = recorded(stir, path, scene.pivot_height, delay=given.delay)
    random = np.random.default_rng(given.seed)
    for plane in PLANES:
        noise = random.normal(0.0, math.radians(given.noise_deg), len(values["time"]))
        values[plane] = values[plane] + noise
    write_netcdf(_dataset(values, scene, given), out)
    open_recording(out)
    return out


def scaled(path: GripperPath, factor: float) -> GripperPath:
    """The path with all its lengths times a factor."""

    def motion(time: float) -> Motion:
        return Motion(*(factor * part for part in path.motion(time)))

    return GripperPath(motion, path.duration)


def recorded(
    stir: Stir, path: GripperPath, height: float, *, delay: float = 0.0
) -> dict[str, np.ndarray]:
    """What a recorder writes down of a stir, by the names of its file.

    Args:
        stir: The stick's motion.
        path: Of the gripper, as it is written down.
        height: Of the pivot above the cup's floor [m].
        delay: By which the cameras are late [s].
    """
    time = np.arange(math.floor(path.duration * FRAMES_A_SECOND + 1e-9) + 1) / FRAMES_A_SECOND
    position = np.array([path.motion(moment).position for moment in time])
    position[:, 2] += height
    seen = np.clip(time - delay, stir.time[0], stir.time[-1])
    angles = CubicSpline(stir.time, stir.inclination)(seen)
    columns = [time, *position.T, *angles.T]
    return dict(zip(("time", *AXES, *PLANES), columns, strict=True))


def _dataset(
    values: dict[str, np.ndarray], scene: StirScene, given: argparse.Namespace
) -> "Dataset":
    """The file's content: what a person would write down, without what is hidden."""
    attributes: dict[str, float | str] = {
        "cup_radius": scene.cup_radius,
        "cup_height": given.cup_height_cm * CENTIMETRE,
        "fill": given.fill_cm * CENTIMETRE,
        "stick_radius": scene.stick_radius,
        "stick_length": scene.stick_length,
        "stick_density": scene.stick_density,
        "liquid_density": given.density,
        "status": "complete",
        "source": "Navier-Stokes reference, simulated",
    }
    return recording_dataset(values, attributes)


def _scene(given: argparse.Namespace) -> StirScene:
    fill = given.fill_cm if given.true_fill_cm is None else given.true_fill_cm
    x, y = (math.radians(angle) for angle in given.tilt_deg)
    return StirScene(
        cup_radius=given.cup_radius_cm * CENTIMETRE,
        fill=fill * CENTIMETRE,
        stick_radius=given.stick_radius_cm * CENTIMETRE,
        stick_length=given.stick_length_cm * CENTIMETRE,
        stick_density=given.stick_density,
        clearance=given.clearance_cm * CENTIMETRE,
        dry_friction=given.dry_friction,
        extra_mass=given.extra_mass,
        tilt=(x, y),
    )


def _path(given: argparse.Namespace) -> GripperPath:
    radius, speed = given.radius_cm * CENTIMETRE, given.speed_cm * CENTIMETRE
    rest = {"lead": given.rest, "tail": given.tail}
    if given.corners_cm:
        corners = [[float(x) for x in corner.split(",")] for corner in given.corners_cm]
        return polygon(np.array(corners) * CENTIMETRE, speed, **rest)
    if given.turns:
        return circle(radius, speed, turns=given.turns, **rest)
    return star(radius, speed, points=given.points, skip=(given.points - 1) // 2, **rest)


def _show(fraction: float) -> None:
    print(f"\r{fraction:4.0%}", end="", file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", metavar="OUT.nc")
    liquid = parser.add_argument_group("liquid and solver")
    _numbers(liquid, {"--viscosity": "Pa s", "--density": "kg/m³"})
    _numbers(liquid, {"--cell-mm": "of the grid", "--step-ms": "of time"}, (1.5, 1.0))
    path = parser.add_argument_group("path")
    _numbers(path, {"--radius-cm": "of the star or circle", "--speed-cm": "cm/s"}, (2.5, 10.0))
    path.add_argument("--points", type=int, default=9, help="of the star, an odd number")
    path.add_argument("--turns", type=float, help="of a circle, instead of the star")
    path.add_argument("--corners-cm", nargs="+", metavar="X,Y", help="of straight strokes instead")
    _numbers(path, {"--rest": "before, s", "--tail": "rest after, s"}, (0.5, 0.5))
    rig = parser.add_argument_group("rig")
    _numbers(rig, {"--cup-radius-cm": "", "--cup-height-cm": "", "--fill-cm": ""}, (4.0, 7.5, 5.0))
    _numbers(rig, {"--stick-radius-cm": "", "--stick-length-cm": ""}, (0.45, 22.0))
    _numbers(rig, {"--stick-density": "kg/m³"}, (1200.0,))
    _numbers(rig, {"--clearance-cm": "from the floor to the stick"}, (1.5,))
    _numbers(rig, {"--noise-deg": "of the cameras"}, (0.1,))
    rig.add_argument("--seed", type=int, default=0, help="of the noise")
    _hidden(parser.add_argument_group("hidden: acts on the stir and is not written"))
    return parser


def _hidden(group: "argparse._ArgumentGroup") -> None:
    group.add_argument("--true-fill-cm", type=float, help="by default as written")
    group.add_argument(
        "--tilt-deg", type=float, nargs=2, default=(0.0, 0.0), help="first inclination, xz and yz"
    )
    _numbers(group, {"--extra-mass": "fraction by which the stick is heavier"}, (0.0,))
    _numbers(group, {"--dry-friction": "of the pivot, N m"}, (0.0,))
    _numbers(group, {"--warming": "factor by which viscosity falls until the end"}, (1.0,))
    _numbers(group, {"--path-scale": "written path over the true one"}, (1.0,))
    _numbers(group, {"--delay": "of the cameras, s"}, (0.0,))


def _numbers(
    group: "argparse._ArgumentGroup", options: dict[str, str], defaults: tuple[float, ...] = ()
) -> None:
    """Options of one number each; those without a default are required."""
    for i, (name, text) in enumerate(options.items()):
        default = defaults[i] if defaults else None
        told = text if default is None else f"{text} (default {default:g})".strip()
        group.add_argument(name, type=float, default=default, required=not defaults, help=told)


if __name__ == "__main__":
    print(main())
