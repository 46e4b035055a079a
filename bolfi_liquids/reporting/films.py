"""Moving pictures of the page: the stirring and the chosen pour, of a few liquids of the posterior.

Each is a film in the folder `moving` of the run, simulated and drawn as by `simulate --movie`. Its
name ends with a digest of what is simulated for it; a film that is there is not made again.
"""

import json
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..files import write_whole
from ..inputs.cups import kept_cups
from ..inputs.recording import Recording
from ..movie.file import encoded
from ..pouring.landed_pours import Parcels
from ..progress import progress_bar
from ..run.run import MOVING, as_json
from ..seeds import Phase, simulation_seeds
from ..simulators import RATE, PourSimulator, stir_simulator
from ..wording import spoken, with_unit

if TYPE_CHECKING:
    from ..calibration.result import Calibration
    from ..inference.simulations import Compute
    from ..pouring.result import Pour

N_DRAWS_SHOWN = 3
"""Posterior draws that are shown."""

MAX_STIR_SECONDS = 3.0
"""Of a stir that is shown [s]."""

FILM_RATE = 6.0
"""Pictures per second."""

FILM_SHARE = 0.6
"""Of the size of a movie's pictures: three stand side by side."""


class Draw(NamedTuple):
    """A liquid of the posterior with its effects, and the seed with which it is shown."""

    theta: dict[str, float]
    seed: int

    def __str__(self) -> str:
        shown = self.theta.items()
        return ", ".join(f"{spoken(name)} {with_unit(name, value)}" for name, value in shown)


class StirScene(NamedTuple):
    """A stir that can be shown, of any liquid.

    Attributes:
        recording: Whose path is stirred.
        particles: Number of particles; 0 for the default.
        timeout: Seconds that one simulation may take; None sets no limit.
    """

    recording: Recording
    particles: int
    timeout: float | None

    name = "stir"

    @property
    def content(self) -> dict[str, Any]:
        """All that is shown besides the liquid."""
        return {"recording": self.recording.hash, "particles": self.particles}

    def __call__(self, draw: Draw) -> bytes:
        """A film in WebP; empty where the simulation diverges."""
        from ..movie.stir import stir_pictures

        simulator = stir_simulator([self.recording], self.particles)
        (setup,) = simulator.setups
        with _limited(self.timeout):
            frames = simulator.frames(draw.theta, draw.seed, FILM_RATE)
        if not np.isfinite(frames.tip).all():
            return b""
        return encoded(stir_pictures(frames, setup, (), FILM_SHARE), FILM_RATE)


class PourScene(NamedTuple):
    """A pour that can be shown, of any liquid.

    Attributes:
        settings: Of source and receiver, see `Cups.settings`.
        angular_velocity, distance: The chosen action [rad/s], [m].
        density: Of the liquid [kg/m3].
        timeout: Seconds that one simulation may take; None sets no limit.
    """

    settings: dict[str, Any]
    angular_velocity: float
    distance: float
    density: float
    timeout: float | None

    name = "pour"

    @property
    def content(self) -> dict[str, Any]:
        """All that is shown besides the liquid."""
        return self._replace(timeout=None)._asdict()

    def __call__(self, draw: Draw) -> bytes:
        """A film in WebP; empty where the simulation diverges."""
        from ..movie.pour import pour_pictures

        cups = kept_cups(self.settings)
        simulator = PourSimulator(cups, self.density, Parcels())
        theta = draw.theta | {RATE: self.angular_velocity}
        with _limited(self.timeout):
            frames = simulator.frames(theta, draw.seed, FILM_RATE)
        result = frames.landed.into(self.distance, cups.receiver.radius)
        if not np.isfinite(result.spilled).all():
            return b""
        pictures = pour_pictures(frames, frames.landed, cups, self.distance, (), FILM_SHARE)
        return encoded(pictures, FILM_RATE)


class Film(NamedTuple):
    """A film of a run.

    Attributes:
        scene: Makes it.
        draw: The liquid that it shows.
        path: Its file.
    """

    scene: StirScene | PourScene
    draw: Draw
    path: Path


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
    recording = whole.first(int(np.sum(whole.time - whole.time[0] <= MAX_STIR_SECONDS)))
    scenes: list[StirScene | PourScene] = [
        StirScene(recording, int(settings["particles"]), compute.timeout)
    ]
    if pour is not None:
        cups, density = json.loads(pour.tree.attrs["cups"]), calibration.liquid_density
        action = pour.chosen.angular_velocity, pour.chosen.distance
        scenes.append(PourScene(cups, *action, density, compute.timeout))
    seed, folder = int(settings["seed"]), calibration.path / MOVING
    draws = _draws(calibration.draws(N_DRAWS_SHOWN, seed), seed)
    films = [
        Film(scene, draw, folder / f"{scene.name}-{number}-{_digest(scene, draw)}.webp")
        for scene in scenes
        for number, draw in enumerate(draws, start=1)
    ]
    folder.mkdir(exist_ok=True)
    missing = [film for film in films if not film.path.exists()]
    try:
        with progress_bar("moving pictures", len(missing), shown=progress) as advance:
            for film, content in zip(missing, _made(missing, compute.executor), strict=True):
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


def _digest(scene: StirScene | PourScene, draw: Draw) -> str:
    """Of all that a film shows."""
    from ..models import MODEL_VERSION

    common = {
        "model": MODEL_VERSION,
        "rate": FILM_RATE,
        "share": FILM_SHARE,
        "seconds": MAX_STIR_SECONDS,
    }
    shown = as_json({**common, **scene.content, **draw._asdict()})
    return sha256(shown.encode()).hexdigest()[:12]


def _draws(theta: Mapping[str, np.ndarray], seed: int) -> list[Draw]:
    """Each draw of theta, values of shape (draws,), with a seed."""
    seeds = simulation_seeds(seed, Phase.MOVING_PICTURES, N_DRAWS_SHOWN)
    each = [{name: float(of[at]) for name, of in theta.items()} for at in range(len(seeds))]
    return [Draw(*one) for one in zip(each, seeds, strict=True)]


def _made(films: list[Film], workers: Executor | None) -> Iterator[bytes]:
    """The content of each film, in order; an executor begins with all of them at once."""
    return map(_shown, films) if workers is None else workers.map(_shown, films)


def _shown(film: Film) -> bytes:
    return film.scene(film.draw)


def _limited(timeout: float | None) -> AbstractContextManager[None]:
    """Inside, a simulation that takes longer raises TimeoutError."""
    from ..models import time_limit

    return nullcontext() if timeout is None else time_limit(timeout)
