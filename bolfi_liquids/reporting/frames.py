"""frames.nc: what the stirring and the chosen pour look like, at a few draws of the posterior.

Dimension `draw`, for each of which `stirred` particles (stir_frame, stir_particle, axis) [m] with
the stick's `pivot` and `tip`, its `inclination` as the cameras would see it (frame, plane) [rad],
and, where a pour was chosen, `poured` particles (pour_frame, pour_particle, axis) [m], NaN once
they are past the receiver's rim, with the source's `angle` [rad] and the share `caught` so far.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inputs.cups import kept_cups
from ..inputs.prior import split_parameters
from ..inputs.recording import Recording
from ..progress import Advance, progress_bar
from ..run.result_file import read_result, write_result
from ..run.run import FRAMES, as_json
from ..seeds import Phase, simulation_seeds
from ..wording import unit_of
from .scenes import FRAME_RATE, Draw, PourScene, PourShown, StirScene

if TYPE_CHECKING:
    from xarray import Dataset

    from ..calibration.result import Calibration
    from ..inference.simulations import Compute
    from ..models import StirFrames
    from ..pouring.result import Pour

N_DRAWS_SHOWN = 3
"""Posterior draws that are shown."""

MAX_STIR_SECONDS = 10.0
"""Of a stir that is shown [s]."""


class Shown(NamedTuple):
    """What is shown of a run.

    Attributes:
        calibration: The latest.
        recording: The first that was calibrated on.
        pour: The chosen one; None where there is none.
    """

    calibration: "Calibration"
    recording: Recording
    pour: "Pour | None"

    @property
    def action(self) -> dict[str, Any] | None:
        """The chosen pour: its angular velocity, distance and cups."""
        if self.pour is None:
            return None
        return {**self.pour.chosen.action, "cups": json.loads(self.pour.tree.attrs["cups"])}


def frames_of(shown: Shown, compute: "Compute", *, progress: bool = True) -> "Dataset":
    """The run's frames; simulated if there are none of this calibration and pour.

    Args:
        shown: What they are of.
        compute: Where draws are simulated.
        progress: Whether to show a bar on stderr.

    Raises:
        RuntimeError: A simulation took longer than the timeout; nothing was written.
    """
    calibration, whole, pour = shown.calibration, shown.recording, shown.action
    recording = whole.first(int(np.sum(whole.time - whole.time[0] <= MAX_STIR_SECONDS)))
    seed = int(calibration.record["settings"]["seed"])
    theta = calibration.draws(N_DRAWS_SHOWN, seed)
    seeds = simulation_seeds(seed, Phase.MOVING_PICTURES, N_DRAWS_SHOWN)
    made_from = _made_from(theta, seeds, recording, calibration.record["settings"], pour)
    path = calibration.path / FRAMES
    with suppress(OSError, ValueError):  # none is there, or it is damaged
        if (kept := read_result(path)).attrs["made_from"] == as_json(made_from):
            return kept.to_dataset()
    scenes = _scenes(calibration, recording, pour, compute.timeout)
    from xarray import DataTree

    try:
        frames = _simulated(scenes, _draws(theta, seeds), compute.executor, progress)
    except TimeoutError as err:
        if compute.timeout is None:
            raise
        raise RuntimeError(
            f"a moving picture took longer than {compute.timeout:g} s to simulate; allow more "
            "time, or leave the pictures out by --still, in Python by moving=False"
        ) from err
    dataset = _named(frames, theta).assign_attrs(made_from=as_json(made_from))
    write_result(DataTree(dataset), path)
    return dataset


class _Scenes(NamedTuple):
    stir: StirScene
    pour: PourScene | None


def _scenes(
    calibration: "Calibration",
    recording: Recording,
    pour: Mapping[str, Any] | None,
    timeout: float | None,
) -> _Scenes:
    from ..simulators import stir_simulator

    particles = int(calibration.record["settings"]["particles"])
    stir = StirScene(stir_simulator([recording], particles), timeout)
    if pour is None:
        return _Scenes(stir, None)
    action = float(pour["angular_velocity"]), float(pour["distance"])
    cups, density = kept_cups(pour["cups"]), calibration.liquid_density
    return _Scenes(stir, PourScene(cups, *action, density, timeout))


def _simulated(
    scenes: _Scenes, draws: list[Draw], workers: Executor | None, progress: bool
) -> dict[str, Any]:
    """All of the file's variables but theta."""
    steps = len(draws) * sum(scene is not None for scene in scenes)
    with progress_bar("moving pictures", steps, shown=progress) as advance:
        stirs = _each(scenes.stir, draws, workers, advance)
        pours = None if scenes.pour is None else _each(scenes.pour, draws, workers, advance)
        frames = _stirred(list(stirs), scenes.stir.stirring.time)
        return frames if pours is None else frames | _poured(list(pours))


def _each[T](
    scene: Callable[[Draw], T], draws: list[Draw], workers: Executor | None, advance: Advance
) -> Iterator[T]:
    """What is seen of each draw, in order; an executor begins with all of them at once."""
    shown = map(scene, draws) if workers is None else workers.map(scene, draws)

    def counted() -> Iterator[T]:
        for one in shown:
            yield one
            advance(1)

    return counted()


def _named(frames: Mapping[str, Any], theta: Mapping[str, NDArray]) -> "Dataset":
    from xarray import Dataset

    drawn = {name: ("draw", values, _unit(name)) for name, values in theta.items()}
    named: dict[Any, Any] = {**frames}
    return Dataset(named, coords=drawn)


def _unit(name: str) -> dict[str, str]:
    """Attributes of a parameter."""
    unit = unit_of(name)
    return {"units": unit} if unit else {}


def _made_from(
    theta: Mapping[str, NDArray],
    seeds: list[int],
    recording: Recording,
    settings: Mapping[str, Any],
    pour: Mapping[str, Any] | None,
) -> dict[str, Any]:
    """All that the frames show."""
    from ..models import MODEL_VERSION

    return {
        "model": MODEL_VERSION,
        "frame_rate": FRAME_RATE,
        "seconds": MAX_STIR_SECONDS,
        "particles": settings["particles"],
        "liquids": {name: values.tolist() for name, values in theta.items()},
        "seeds": seeds,
        "recording": recording.hash,
        "pour": pour,
    }


def _draws(theta: Mapping[str, NDArray], seeds: list[int]) -> list[Draw]:
    liquid, effects = split_parameters(theta)
    return [
        Draw(
            {name: float(values[at]) for name, values in liquid.items()},
            {name: float(values[at]) for name, values in effects.items()},
            seed,
        )
        for at, seed in enumerate(seeds)
    ]


def _stirred(made: list["StirFrames"], time: NDArray) -> dict[str, Any]:
    metres, frame = {"units": "m"}, ("draw", "stir_frame")
    return {
        "stir_time": ("stir_frame", made[0].time, {"units": "s"}),
        "stirred": ((*frame, "stir_particle", "axis"), _stack(made, "position"), metres),
        "pivot": ((*frame, "axis"), _stack(made, "pivot"), metres),
        "tip": ((*frame, "axis"), _stack(made, "tip"), metres),
        "time": ("frame", time, {"units": "s"}),
        "inclination": (
            ("draw", "frame", "plane"),
            np.stack([one.inclination for one in made]),
            {"units": "rad"},
        ),
    }


def _poured(shown: list[PourShown]) -> dict[str, Any]:
    made, frame = [one.frames for one in shown], ("draw", "pour_frame")
    return {
        "pour_time": ("pour_frame", made[0].time, {"units": "s"}),
        "poured": ((*frame, "pour_particle", "axis"), _stack(made, "position"), {"units": "m"}),
        "angle": ("pour_frame", made[0].angle, {"units": "rad"}),
        "caught": (frame, np.stack([one.caught for one in shown])),
        "spilled": ("draw", np.array([one.spilled for one in shown])),
        "retained": ("draw", np.array([one.retained for one in shown])),
    }


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
