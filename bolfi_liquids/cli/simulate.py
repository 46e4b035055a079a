"""The command group `simulate`: one stir or one pour of a liquid given by numbers."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..inputs.described_liquid import COHESION, DENSITY, VISCOSITY, read_effects
from .options import ComputeOptions, CupsOption, ParticlesOption, examples, grouped

if TYPE_CHECKING:
    from xarray import Dataset

app = typer.Typer(help="Simulate one stir or one pour, and look at it.", no_args_is_help=True)

ViscosityOption = Annotated[float, typer.Option(help="Of the liquid, in Pa s.")]
CohesionOption = Annotated[float, typer.Option(help="Of the liquid, 0 to 1.")]
EffectOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME=VALUE", help="An effect; may be repeated.")
]
SeedOption = Annotated[int, typer.Option(help="Seed of the particles' first places.")]
MovieOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Show it: .mp4, .gif or .webp.")
]
OutOption = Annotated[
    Path | None,
    typer.Option(metavar="NC", help="The result; of a stir, a recording without noise."),
]


@app.command(epilog=examples("simulate stir --viscosity 0.1 --movie oil.webp"))
@grouped
def stir(  # noqa: PLR0913  an option each
    compute: ComputeOptions,
    viscosity: ViscosityOption = VISCOSITY,
    cohesion: CohesionOption = COHESION,
    density: Annotated[
        float | None, typer.Option(help="Of the liquid, in kg/m³; else the recording's.")
    ] = None,
    effect: EffectOption = None,
    seed: SeedOption = 0,
    particles: ParticlesOption = 0,
    recording: Annotated[
        Path | None,
        typer.Option(metavar="NC", help="Whose path and rig are used; else a bundled one."),
    ] = None,
    movie: MovieOption = None,
    out: OutOption = None,
) -> None:
    """Stir a liquid along a recorded path.

    What --out writes can be calibrated on; it has no noise. Effects in the
    cameras show there, but not in the movie.
    """
    import numpy as np

    from ..simulation.simulate import simulate_stir

    with compute.arguments() as where:
        made = simulate_stir(
            viscosity,
            cohesion,
            density=density,
            effects=read_effects(effect or (), "stir"),
            recording=recording,
            particles=particles,
            seed=seed,
            movie=movie,
            out=out,
            **where,
        )
    largest = (
        f"{np.degrees(np.abs(made[f'inclination_{plane}']).max().item()):.2f} deg in {plane}"
        for plane in ("xz", "yz")
    )
    _tell(
        made,
        f"path of {made.attrs['path_of']}, {float(made['time'][-1]):.1f} s",
        f"largest inclination: {', '.join(largest)}",
        movie=movie,
        file=out,
    )


@app.command(
    epilog=examples(
        "simulate pour --viscosity 20 --distance 2 --effect adhesion=0.3 --movie gel.gif"
    )
)
@grouped
def pour(  # noqa: PLR0913  an option each
    compute: ComputeOptions,
    viscosity: ViscosityOption = VISCOSITY,
    cohesion: CohesionOption = COHESION,
    density: Annotated[float, typer.Option(help="Of the liquid, in kg/m³.")] = DENSITY,
    effect: EffectOption = None,
    seed: SeedOption = 0,
    particles: ParticlesOption = 0,
    angular_velocity: Annotated[
        float, typer.Option(help="Of the source about its lip, in deg/s.")
    ] = 60.0,
    distance: Annotated[
        float, typer.Option(help="From the lip to the receiver's axis, in cm.")
    ] = 3.0,
    cups: CupsOption = None,
    movie: MovieOption = None,
    out: OutOption = None,
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
            viscosity,
            cohesion,
            angular_velocity=float(np.radians(angular_velocity)),
            distance=distance / 100.0,
            density=density,
            effects=read_effects(effect or (), "pour"),
            cups=cups,
            particles=particles,
            seed=seed,
            movie=movie,
            out=out,
            **where,
        )
    _tell(
        made,
        f"{angular_velocity:g} deg/s, lip to axis {distance:g} cm",
        ", ".join(f"{name} {made[name].item():.1%}" for name in FRACTIONS),
        movie=movie,
        file=out,
    )


def _tell(made: "Dataset", *lines: str, **files: Path | None) -> None:
    """The liquid that was simulated, how, what came of it, and the files that hold it."""
    from ..simulation.simulate import described

    typer.echo("\n".join([*described(made).lines(), *lines]))
    for name, path in files.items():
        if path is not None:
            typer.echo(f"{name}: {path}")
