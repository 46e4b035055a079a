"""The command group `simulate`: one stir or one pour of a liquid given by numbers."""

from pathlib import Path
from typing import Annotated

import typer

from .examples import examples

app = typer.Typer(help="Simulate one stir or one pour, and look at it.", no_args_is_help=True)

Viscosity = Annotated[float, typer.Option(help="Of the liquid, in Pa s.")]
Cohesion = Annotated[float, typer.Option(help="Of the liquid, 0 to 1.")]
Effects = Annotated[
    list[str] | None,
    typer.Option("--effect", metavar="NAME=VALUE", help="An effect; may be repeated."),
]
Particles = Annotated[int, typer.Option(help="Of which the simulated liquid is made.")]
Seed = Annotated[int, typer.Option(help="Of the particles' first places.")]
Movie = Annotated[Path | None, typer.Option(metavar="FILE", help="Show it: .mp4, .gif or .webp.")]
GLYCERIN = {"viscosity": 1.0, "cohesion": 0.2, "density": 1260.0}


@app.command(epilog=examples("simulate stir --viscosity 0.1 --movie oil.webp"))
def stir(  # noqa: PLR0913  one parameter for each option
    viscosity: Viscosity = GLYCERIN["viscosity"],
    cohesion: Cohesion = GLYCERIN["cohesion"],
    density: Annotated[
        float | None, typer.Option(help="Of the liquid, in kg/m³; else the recording's.")
    ] = None,
    effect: Effects = None,
    particles: Particles = 1000,
    seed: Seed = 0,
    recording: Annotated[
        Path | None,
        typer.Option(metavar="NC", help="Whose path and rig are used; else a bundled one."),
    ] = None,
    movie: Movie = None,
    out: Annotated[
        Path | None, typer.Option(metavar="NC", help="The inclination, as a recording.")
    ] = None,
) -> None:
    """Stir a liquid along a recorded path.

    What --out writes can be calibrated on; it has no noise. Effects in the
    cameras show there, but not in the movie.
    """
    import numpy as np

    from ..inputs.bundled import bundled_recording
    from ..inputs.described_liquid import Described, read_effects
    from ..inputs.open import open_recording
    from ..simulation.simulate import simulate_stir

    opened = bundled_recording("glycerin") if recording is None else open_recording(recording)
    density = opened.number("liquid_density") if density is None else density
    effects = read_effects(effect or (), "stir")
    described = Described(viscosity, cohesion, density, effects, particles, seed)
    angles = simulate_stir(described, opened, movie=movie, out=out)
    xz, yz = np.degrees(np.abs(angles).max(axis=0))
    _tell([*described.lines(), f"path of {opened.path.name}, {opened.time[-1]:.1f} s"])
    typer.echo(f"largest inclination: {xz:.2f} deg in xz, {yz:.2f} deg in yz")
    _tell_files(movie, out)


@app.command(
    epilog=examples(
        "simulate pour --viscosity 20 --distance 2 --effect adhesion=0.3 --movie gel.gif"
    )
)
def pour(  # noqa: PLR0913  one parameter for each option
    viscosity: Viscosity = GLYCERIN["viscosity"],
    cohesion: Cohesion = GLYCERIN["cohesion"],
    density: Annotated[float, typer.Option(help="Of the liquid, in kg/m³.")] = GLYCERIN["density"],
    effect: Effects = None,
    particles: Particles = 664,
    seed: Seed = 0,
    angular_velocity: Annotated[
        float, typer.Option(help="Of the source about its lip, in deg/s.")
    ] = 60.0,
    distance: Annotated[
        float, typer.Option(help="From the lip to the receiver's axis, in cm.")
    ] = 3.0,
    cups: Annotated[
        Path | None, typer.Option(metavar="FILE", help="cups.toml; without it, the bundled one.")
    ] = None,
    movie: Movie = None,
    out: Annotated[
        Path | None, typer.Option(metavar="NC", help="The fractions, and where it landed.")
    ] = None,
) -> None:
    """Pour a liquid from one cup into another.

    The fluid is simulated down to the receiver's rim. The movie lets it fall
    on from there, and draws what the receiver holds as a level.
    """
    import numpy as np

    from ..inputs.cups import bundled_cups, open_cups
    from ..inputs.described_liquid import Described, read_effects
    from ..simulation.simulate import simulate_pour

    opened = bundled_cups() if cups is None else open_cups(cups)
    effects = read_effects(effect or (), "pour")
    described = Described(viscosity, cohesion, density, effects, particles, seed)
    action = float(np.radians(angular_velocity)), distance / 100.0
    fractions = simulate_pour(described, opened, *action, movie=movie, out=out)
    _tell([*described.lines(), f"{angular_velocity:g} deg/s, lip to axis {distance:g} cm"])
    typer.echo(", ".join(f"{name} {share:.1%}" for name, share in fractions.items()))
    _tell_files(movie, out)


def _tell(lines: list[str]) -> None:
    typer.echo("\n".join(lines))


def _tell_files(movie: Path | None, out: Path | None) -> None:
    for name, path in (("movie", movie), ("file", out)):
        if path is not None:
            typer.echo(f"{name}: {path}")
