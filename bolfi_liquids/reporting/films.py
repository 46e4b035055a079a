"""Films of the page: the stirring and the chosen pour, of a few liquids of the posterior.

Each is a file in the folder `moving` of the run, simulated and drawn as by `simulate --movie`. Its
name ends with a digest of what is simulated for it; a film that is there is not made again.
"""

import base64
import json
from collections.abc import Iterator
from contextlib import nullcontext
from functools import partial
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..files import write_whole
from ..inputs.cups import kept_cups
from ..movie.file import encoded
from ..pouring.landed_pours import Parcels
from ..progress import progress_bar
from ..run.run import MOVING
from ..seeds import Phase, simulation_seeds
from ..simulators import RATE, PourSimulator, StirSimulator, stir_simulator
from ..wording import spoken, with_unit

if TYPE_CHECKING:
    from ..calibration.result import Calibration
    from ..inference.simulations import Compute
    from ..models import PourFrames, StirFrames
    from ..pouring.result import Pour

N_DRAWS_SHOWN = 3
"""Posterior draws that are shown."""

MAX_STIR_SECONDS = 3.0
"""Of a stir that is shown [s]."""

FILM_RATE = 6.0
"""Pictures per second."""

FILM_SHARE = 0.6
"""Of the size of a movie's pictures: three stand side by side."""


class StirScene(NamedTuple):
    """The stir of a recording, of any liquid."""

    simulator: StirSimulator

    name = "stir"

    def frames(self, theta: dict[str, float], seed: int) -> "StirFrames":
        """Simulate the stir of one liquid."""
        return self.simulator.frames(theta, seed, FILM_RATE)

    def pictures(self, frames: "StirFrames") -> Iterator[NDArray[np.uint8]]:
        """Draw each frame."""
        from ..movie.stir import stir_pictures

        return stir_pictures(frames, self.simulator.setups[0], (), FILM_SHARE)


class PourScene(NamedTuple):
    """A pour at an angular velocity [rad/s] and a distance [m], of any liquid."""

    simulator: PourSimulator
    angular_velocity: float
    distance: float

    name = "pour"

    def frames(self, theta: dict[str, float], seed: int) -> "PourFrames":
        """Simulate the pour of one liquid."""
        return self.simulator.frames(theta | {RATE: self.angular_velocity}, seed, FILM_RATE)

    def pictures(self, frames: "PourFrames") -> Iterator[NDArray[np.uint8]]:
        """Draw each frame."""
        from ..movie.pour import pour_pictures

        return pour_pictures(frames, self.simulator.cups, self.distance, (), FILM_SHARE)


class Film(NamedTuple):
    """A film of a run.

    Attributes:
        scene: What happens.
        theta: Of the liquid: its parameters, and the coefficients of effects.
        seed: Of the packing.
        folder: Where it is kept.
    """

    scene: StirScene | PourScene
    theta: dict[str, float]
    seed: int
    folder: Path

    @property
    def liquid(self) -> str:
        """The liquid in words."""
        shown = self.theta.items()
        return ", ".join(f"{spoken(name)} {with_unit(name, value)}" for name, value in shown)

    @property
    def path(self) -> Path:
        """Its file, in WebP; empty if the simulation diverges."""
        from ..models import MODEL_VERSION

        simulator, *action = self.scene
        simulated = [simulator.identity, action, self.theta, self.seed]
        shown = json.dumps([MODEL_VERSION, FILM_RATE, FILM_SHARE, *simulated])
        digest = sha256(shown.encode()).hexdigest()[:12]
        return self.folder / f"{self.scene.name}-{digest}.webp"

    @property
    def moving(self) -> str:
        """The film, as the URL of an image."""
        return _url(self.path.read_bytes())

    @property
    def still(self) -> str:
        """The picture in its middle, as a URL."""
        from PIL import Image

        picture = BytesIO()
        with Image.open(self.path) as film:
            film.seek(film.n_frames // 2)  # type: ignore[attr-defined]
            film.convert("RGB").save(picture, "WEBP", quality=85)
        return _url(picture.getvalue())


def films_of(
    calibration: "Calibration",
    pour: "Pour | None",
    compute: "Compute",
    *,
    progress: bool = True,
) -> list[Film]:
    """The run's films, those of the stir first; simulated where they are not there.

    Args:
        calibration: The latest.
        pour: The chosen one; None where there is none.
        compute: Where draws are simulated.
        progress: Whether to show a bar on stderr.

    Raises:
        RuntimeError: A simulation took longer than the timeout.
    """
    settings, whole = calibration.record["settings"], calibration.run.recordings[0]
    start = whole.first(int(np.sum(whole.time - whole.time[0] <= MAX_STIR_SECONDS)))
    scenes: list[Any] = [StirScene(stir_simulator([start], int(settings["particles"])))]
    if pour is not None:
        cups, action = kept_cups(json.loads(pour.tree.attrs["cups"])), pour.chosen
        simulator = PourSimulator(cups, calibration.liquid_density, Parcels())
        scenes.append(PourScene(simulator, action.angular_velocity, action.distance))
    seed, folder = int(settings["seed"]), calibration.path / MOVING
    drawn = calibration.draws(N_DRAWS_SHOWN, seed)
    seeds = simulation_seeds(seed, Phase.MOVING_PICTURES, N_DRAWS_SHOWN)
    thetas = [{name: float(of[at]) for name, of in drawn.items()} for at in range(len(seeds))]
    films = [
        Film(scene, theta, int(own), folder)
        for scene in scenes
        for theta, own in zip(thetas, seeds, strict=True)
    ]
    folder.mkdir(exist_ok=True)
    missing = [film for film in films if not film.path.exists()]
    try:
        with progress_bar("moving pictures", len(missing), shown=progress) as advance:
            for film, content in zip(missing, _made(missing, compute), strict=True):
                write_whole(film.path, lambda at, content=content: at.write_bytes(content))
                advance(1)
    except TimeoutError as err:
        if compute.timeout is None:
            raise
        raise RuntimeError(
            f"a moving picture took longer than {compute.timeout:g} s to simulate; allow more "
            "time, or leave the pictures out by --still, in Python by moving=False"
        ) from err
    for outdated in set(folder.glob("*.webp")) - {film.path for film in films}:
        outdated.unlink()
    return films


def _made(films: list[Film], compute: "Compute") -> Iterator[bytes]:
    """The content of each film, in order; an executor begins with all of them at once."""
    simulate = map if compute.executor is None else compute.executor.map
    return simulate(partial(_content, timeout=compute.timeout), films)


def _content(film: Film, timeout: float | None) -> bytes:
    """A film in WebP; empty if the simulation diverges.

    Raises:
        TimeoutError: The simulation took longer than the timeout.
    """
    from ..models import time_limit

    with nullcontext() if timeout is None else time_limit(timeout):
        frames: Any = film.scene.frames(film.theta, film.seed)
    if np.isnan(frames.position[0]).all():
        return b""
    return encoded(film.scene.pictures(frames), FILM_RATE)


def _url(content: bytes) -> str:
    return f"data:image/webp;base64,{base64.b64encode(content).decode()}"
