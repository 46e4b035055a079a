"""The command group `simulate`: one stir or one pour of a liquid given by numbers."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..inputs.described_liquid import COHESION, DENSITY, VISCOSITY
from .compute import ComputeOptions
from .examples import examples
from .grouped import grouped
from .options import CupsOption, ParticlesOption

if TYPE_CHECKING:
    from xarray import Dataset

app = typer.Typer(help="Simulate one stir or one pour, and look at it.", no_args_is_help=True)


@dataclass(frozen=True)
class LiquidOptions:
    """A liquid by numbers."""

    viscosity: Annotated[float, typer.Option(help="Of the liquid, in Pa s.")] = VISCOSITY
    cohesion: Annotated[float, typer.Option(help="Of the liquid, 0 to 1.")] = COHESION
    effect: Annotated[
        list[str] | None,
        typer.Option("--effect", metavar="NAME=VALUE", help="An effect; may be repeated."),
    ] = None
    seed: Annotated[int, typer.Option(help="Seed of the particles' first places.")] = 0

    def given(self, scene: str) -> dict[str, Any]:
        """Arguments of `simulate_stir` and `simulate_pour`."""
        from ..inputs.described_liquid import read_effects

        return {
            "viscosity": self.viscosity,
            "cohesion": self.cohesion,
            "effects": read_effects(self.effect or (), scene),
            "seed": self.seed,
        }


@dataclass(frozen=True)
class FileOptions:
    """Files that a simulation leaves."""

    movie: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Show it: .mp4, .gif or .webp.")
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(metavar="NC", help="The result; of a stir, a recording without noise."),
    ] = None


@dataclass(frozen=True)
class ActionOptions:
    """How a source is turned, and where the receiver stands."""

    angular_velocity: Annotated[
        float, typer.Option(help="Of the source about its lip, in deg/s.")
    ] = 60.0
    distance: Annotated[float, typer.Option(help="From the lip to the receiver's axis, in cm.")] = (
        3.0
    )
    cups: CupsOption = None


@app.command(epilog=examples("simulate stir --viscosity 0.1 --movie oil.webp"))
@grouped
def stir(
    liquid: LiquidOptions,
    files: FileOptions,
    compute: ComputeOptions,
    density: Annotated[
        float | None, typer.Option(help="Of the liquid, in kg/m³; else the recording's.")
    ] = None,
    particles: ParticlesOption = 0,
    recording: Annotated[
        Path | None,
        typer.Option(metavar="NC", help="Whose path and rig are used; else a bundled one."),
    ] = None,
) -> None:
    """Stir a liquid along a recorded path.

    What --out writes can be calibrated on; it has no noise. Effects in the
    cameras show there, but not in the movie.
    """
    import numpy as np

    from ..simulation.simulate import simulate_stir

    with compute.arguments() as where:
        made = simulate_stir(
            **liquid.given("stir"),
            density=density,
            particles=particles,
            recording=recording,
            **where,
            movie=files.movie,
            out=files.out,
        )
    seconds = float(made["time"][-1])
    _tell(made, f"path of {made.attrs['path_of']}, {seconds:.1f} s")
    xz, yz = (
        np.degrees(np.abs(made[f"inclination_{plane}"]).max().item()) for plane in ("xz", "yz")
    )
    typer.echo(f"largest inclination: {xz:.2f} deg in xz, {yz:.2f} deg in yz")
    _tell_files(files)


@app.command(
    epilog=examples(
        "simulate pour --viscosity 20 --distance 2 --effect adhesion=0.3 --movie gel.gif"
    )
)
@grouped
def pour(
    liquid: LiquidOptions,
    action: ActionOptions,
    files: FileOptions,
    compute: ComputeOptions,
    density: Annotated[float, typer.Option(help="Of the liquid, in kg/m³.")] = DENSITY,
    particles: ParticlesOption = 0,
) -> None:
    """Pour a liquid from one cup into another.

    The fluid is simulated down to the receiver's rim. The movie lets it fall
    on from there, and draws what the receiver holds as a level.
    """
    import numpy as np

    from ..pouring.spillage import FRACTIONS
    from ..simulation.simulate import simulate_pour

    with compute.arguments() as where:
        made = simulate_pour(
            **liquid.given("pour"),
            angular_velocity=float(np.radians(action.angular_velocity)),
            distance=action.distance / 100.0,
            density=density,
            cups=action.cups,
            particles=particles,
            **where,
            movie=files.movie,
            out=files.out,
        )
    _tell(made, f"{action.angular_velocity:g} deg/s, lip to axis {action.distance:g} cm")
    typer.echo(", ".join(f"{name} {made[name].item():.1%}" for name in FRACTIONS))
    _tell_files(files)


def _tell(made: "Dataset", how: str) -> None:
    """The liquid that was simulated, and how."""
    import json

    from ..inputs.described_liquid import Described

    numbers = (float(made.attrs[name]) for name in ("viscosity", "cohesion", "liquid_density"))
    effects, particles, seed = (made.attrs[name] for name in ("effects", "particles", "seed"))
    liquid = Described(*numbers, effects=json.loads(effects), particles=particles, seed=seed)
    typer.echo("\n".join([*liquid.lines(), how]))


def _tell_files(files: FileOptions) -> None:
    for name, path in (("movie", files.movie), ("file", files.out)):
        if path is not None:
            typer.echo(f"{name}: {path}")
