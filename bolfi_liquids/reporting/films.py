"""Films of the page: the stirring and the chosen pour, of a few liquids of the posterior.

Each is a file in the folder `moving` of the run, simulated and drawn as by `simulate --movie`. Its
name ends with a digest of what is simulated for it; a film that is there is not made again.
"""

import base64
import json
from contextlib import nullcontext
from functools import partial
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..criticism.result import check_known
from ..files import write_whole
from ..inputs.cups import kept_cups
from ..movie.file import encoded
from ..pouring.parcels import Parcels
from ..progress import progress_bar
from ..run.run import MOVING
from ..seeds import Phase, simulation_seeds
from ..simulators import RATE, PourSimulator, StirSimulator, stir_simulator
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


class Film(NamedTuple):
    """A film of a run.

    Attributes:
        simulator: Of a stir or a pour.
        theta: Of the liquid: its parameters, and the coefficients of effects.
        seed: Of the packing.
        action: Of a pour, as `choose_pour` names it.
        folder: Where it is kept.
    """

    simulator: StirSimulator | PourSimulator
    theta: dict[str, float]
    seed: int
    action: dict[str, float]
    folder: Path

    @property
    def scene(self) -> str:
        """Scene of the film: stir or pour."""
        return "pour" if self.action else "stir"

    @property
    def liquid(self) -> str:
        """The liquid in words."""
        shown = self.theta.items()
        return ", ".join(f"{spoken(name)} {with_unit(name, value)}" for name, value in shown)

    @property
    def path(self) -> Path:
        """Its file, in WebP; empty if the simulation diverges."""
        from ..models import MODEL_VERSION

        simulated = [self.simulator.identity, self.theta, self.seed, self.action]
        shown = json.dumps([MODEL_VERSION, FILM_RATE, FILM_SHARE, *simulated])
        digest = sha256(shown.encode()).hexdigest()[:12]
        return self.folder / f"{self.scene}-{digest}.webp"

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
    calibration: "Calibration", pour: "Pour | None", compute: "Compute", *, progress: bool = True
) -> list[Film]:
    """The run's films, those of the stir first; simulated where they are not there.

    Args:
        calibration: The latest.
        pour: The chosen one; None where there is none.
        compute: Where draws are simulated.
        progress: Whether to show a bar on stderr.

    Raises:
        InputError: This process does not know an accepted effect.
        RuntimeError: A simulation took longer than the timeout.
    """
    check_known(calibration)
    settings, whole = calibration.record["settings"], calibration.run.recordings[0]
    start = whole.first(int(np.sum(whole.time - whole.time[0] <= MAX_STIR_SECONDS)))
    scenes: list[Any] = [(stir_simulator([start], int(settings["particles"])), {})]
    if pour is not None:
        cups, density = kept_cups(json.loads(pour.tree.attrs["cups"])), calibration.liquid_density
        scenes.append((PourSimulator(cups, density, Parcels()), pour.chosen.action))
    seed, folder = int(settings["seed"]), calibration.path / MOVING
    drawn = calibration.draws(N_DRAWS_SHOWN, seed)
    seeds = simulation_seeds(seed, Phase.MOVING_PICTURES, N_DRAWS_SHOWN)
    films = [
        Film(simulator, {name: float(of[at]) for name, of in drawn.items()}, own, action, folder)
        for simulator, action in scenes
        for at, own in enumerate(seeds)
    ]
    folder.mkdir(exist_ok=True)
    missing = [film for film in films if not film.path.exists()]
    # an executor begins with all of them at once
    simulate = map if compute.executor is None else compute.executor.map
    made = simulate(partial(film_content, timeout=compute.timeout), missing)
    try:
        with progress_bar("moving pictures", len(missing), shown=progress) as advance:
            for film, content in zip(missing, made, strict=True):
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


def film_content(film: Film, timeout: float | None = None) -> bytes:
    """Simulate a film and draw it, in WebP; empty if the simulation diverges.

    Raises:
        TimeoutError: The simulation took longer than the timeout [s].
    """
    from ..models import time_limit
    from ..movie.pour import pour_pictures
    from ..movie.stir import stir_pictures

    rate = {RATE: film.action[RATE]} if film.action else {}
    with nullcontext() if timeout is None else time_limit(timeout):
        frames: Any = film.simulator.frames(film.theta | rate, film.seed, FILM_RATE)
    if np.isnan(frames.position[0]).all():
        return b""
    if isinstance(film.simulator, StirSimulator):
        pictures = stir_pictures(frames, film.simulator.setups[0], (), FILM_SHARE)
    else:
        cups, distance = film.simulator.cups, film.action["distance"]
        pictures = pour_pictures(frames, cups, distance, (), FILM_SHARE)
    return encoded(pictures, FILM_RATE)


def _url(content: bytes) -> str:
    return f"data:image/webp;base64,{base64.b64encode(content).decode()}"
