"""frames.nc: what the stirring and the chosen pour look like, at a few draws of the posterior.

Dimension `draw`, for each of which `stirred` particles (stir_frame, stir_particle, axis) [m] with
the stick's `pivot` and `tip`, its `inclination` as the cameras would see it (frame, plane) [rad],
and, where a pour was chosen, `poured` particles (pour_frame, pour_particle, axis) [m], NaN once
they are past the receiver's rim, with the source's `angle` [rad] and the share `caught` so far.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..calibration.tree import read_tree, write_tree
from ..criticism.result import latest_calibration
from ..inputs.cups import kept_cups
from ..inputs.prior import split_parameters
from ..inputs.recording import Recording
from ..pouring.result import read_pour
from ..progress import Advance, progress_bar
from ..run.directory import FRAMES, POUR
from ..run.recordings import kept_recordings
from ..seeds import Phase, simulation_seeds
from ..words import unit_of

if TYPE_CHECKING:
    from xarray import Dataset

    from ..calibration.result import Calibration

N_DRAWS_SHOWN = 3
"""Posterior draws that are shown."""

FRAME_RATE = 15.0
"""Of the pictures [1/s]."""

MAX_STIR_SECONDS = 10.0
"""Of a stir that is shown [s]."""

FRAMES_FORMAT = 1
"""Of the file; another is made again."""


def frames_of(run: str | Path, *, progress: bool = True) -> "Dataset":
    """The run's frames; simulated if there are none of this calibration and pour.

    Args:
        run: A RUN directory with a finished calibration.
        progress: Whether to show a bar on stderr.

    Raises:
        InputError: The directory holds no finished calibration, or its recording is missing.
    """
    calibration = latest_calibration(run)
    whole = kept_recordings(calibration.path, dict(calibration.record))[0]
    recording = whole.first(int(np.sum(whole.time - whole.time[0] <= MAX_STIR_SECONDS)))
    seed = int(calibration.record["settings"]["seed"])
    theta = calibration.draws(N_DRAWS_SHOWN, seed)
    pour = _chosen(calibration.path)
    seeds = simulation_seeds(seed, Phase.MOVING_PICTURES, N_DRAWS_SHOWN)
    made_from = _digest(theta, seeds, recording, calibration.record["settings"], pour)
    path = calibration.path / FRAMES
    if path.is_file():
        kept = read_tree(path, fix="delete it: it is made again").to_dataset()
        if kept.attrs.get("made_from") == made_from:
            return kept
    steps = N_DRAWS_SHOWN * (1 if pour is None else 2)
    with progress_bar("moving pictures", steps, shown=progress) as advance:
        frames = _stirred(calibration, recording, theta, seeds, advance)
        if pour is not None:
            frames.update(_poured(calibration, pour, theta, seeds, advance))
    return _write(frames, theta, made_from, path)


def _write(
    frames: Mapping[str, Any], theta: Mapping[str, NDArray], made_from: str, path: Path
) -> "Dataset":
    from xarray import Dataset, DataTree

    drawn = {name: ("draw", values, _unit(name)) for name, values in theta.items()}
    named: dict[Any, Any] = {**frames}
    dataset = Dataset(named, coords=drawn, attrs={"made_from": made_from})
    write_tree(DataTree(dataset), path)
    return dataset


def _unit(name: str) -> dict[str, str]:
    """Attributes of a parameter."""
    unit = unit_of(name)
    return {"units": unit} if unit else {}


def _chosen(run: Path) -> dict[str, Any] | None:
    """The chosen pour: its angular velocity, distance and cups."""
    if not (run / POUR).is_file():
        return None
    tree = read_pour(run)
    action = {str(name): float(value) for name, value in tree["chosen"].attrs.items()}
    return {**action, "cups": json.loads(tree.attrs["cups"])}


def _digest(
    theta: Mapping[str, NDArray],
    seeds: list[int],
    recording: Recording,
    settings: Mapping[str, Any],
    pour: Mapping[str, Any] | None,
) -> str:
    """SHA-256 of all that the frames show."""
    from ..models import MODEL_VERSION

    liquids = {name: values.tolist() for name, values in theta.items()}
    shown = [FRAMES_FORMAT, MODEL_VERSION, FRAME_RATE, MAX_STIR_SECONDS, settings["particles"]]
    told = [*shown, liquids, seeds, recording.hash, pour]
    return hashlib.sha256(json.dumps(told, sort_keys=True, default=float).encode()).hexdigest()


def _each(theta: Mapping[str, NDArray]) -> list[tuple[dict[str, float], dict[str, float]]]:
    """Parameters of the liquid and coefficients of effects, of each draw."""
    liquid, effects = split_parameters(theta)
    return [
        (
            {name: float(values[at]) for name, values in liquid.items()},
            {name: float(values[at]) for name, values in effects.items()},
        )
        for at in range(N_DRAWS_SHOWN)
    ]


def _stirred(
    calibration: "Calibration",
    recording: Recording,
    theta: Mapping[str, NDArray],
    seeds: list[int],
    advance: Advance,
) -> dict[str, Any]:
    from .. import models
    from ..calibration.stir_simulator import stirring_of

    particles = int(calibration.record["settings"]["particles"])
    stirring = stirring_of([recording], particles)
    density = recording.number("liquid_density")
    made = []
    for (liquid, effects), seed in zip(_each(theta), seeds, strict=True):
        one = models.Liquid(**liquid, density=density)
        made.append(
            models.stir_frames(
                one, recording.gripper, stirring.setups[0], seed, rate=FRAME_RATE, effects=effects
            )
        )
        advance(1)
    seen = stirring.simulate(dict(theta), np.array(seeds))
    metres, frame = {"units": "m"}, ("draw", "stir_frame")
    return {
        "stir_time": ("stir_frame", made[0].time, {"units": "s"}),
        "stirred": ((*frame, "stir_particle", "axis"), _stack(made, "position"), metres),
        "pivot": ((*frame, "axis"), _stack(made, "pivot"), metres),
        "tip": ((*frame, "axis"), _stack(made, "tip"), metres),
        "time": ("frame", recording.time, {"units": "s"}),
        "inclination": (("draw", "frame", "plane"), seen, {"units": "rad"}),
    }


def _poured(
    calibration: "Calibration",
    pour: Mapping[str, Any],
    theta: Mapping[str, NDArray],
    seeds: list[int],
    advance: Advance,
) -> dict[str, Any]:
    from .. import models

    cups = kept_cups(pour["cups"])
    rate, distance = float(pour["angular_velocity"]), float(pour["distance"])
    density = calibration.liquid_density
    made, caught, outcomes = [], [], []
    for (liquid, effects), seed in zip(_each(theta), seeds, strict=True):
        one = models.Liquid(**liquid, density=density)
        batch = models.PourBatch(one, rate, cups, [seed], effects=effects)
        frames = models.pour_frames(batch, rate=FRAME_RATE)
        landed = models.landings(one, rate, cups, [seed], effects=effects)
        made.append(frames)
        inside = landed.inside(distance, cups.receiver.radius)[0]
        caught.append(_caught(frames.position, inside))
        result = landed.into(distance, cups.receiver.radius)
        outcomes.append([float(part[0]) for part in (result.spilled, result.retained)])
        advance(1)
    frame, parts = ("draw", "pour_frame"), np.array(outcomes)
    return {
        "pour_time": ("pour_frame", made[0].time, {"units": "s"}),
        "poured": ((*frame, "pour_particle", "axis"), _stack(made, "position"), {"units": "m"}),
        "angle": ("pour_frame", made[0].angle, {"units": "rad"}),
        "caught": (frame, np.stack(caught)),
        "spilled": ("draw", parts[:, 0]),
        "retained": ("draw", parts[:, 1]),
    }


def _caught(position: NDArray, inside: NDArray) -> NDArray:
    """Share of all particles in the receiver, by frame; they land in the order of `inside`."""
    gone = np.isnan(position[..., 0]).sum(axis=1)
    return np.append(0, np.cumsum(inside))[gone] / len(inside)


def _stack(made: list, name: str) -> NDArray[np.float32]:
    """Of each draw; where an effect changes the number of particles, the fewer end in NaN."""
    parts = [np.asarray(getattr(one, name), np.float32) for one in made]
    most = max(part.shape[1] for part in parts)
    rest = [(0, 0)] * (parts[0].ndim - 2)
    return np.stack(
        [
            np.pad(part, [(0, 0), (0, most - part.shape[1]), *rest], constant_values=np.nan)
            for part in parts
        ]
    )
