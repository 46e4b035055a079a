"""The command `trim`: the part of a recording that can be simulated."""

from pathlib import Path
from typing import Annotated

import typer

from ..wording import command
from .options import examples

EPILOG = examples("trim stir.nc", "trim stir.nc --start 4.2 --stop 11 --out cut.nc")


def trim(
    recording: Annotated[
        Path, typer.Argument(metavar="RECORDING", help="NetCDF file, or the directory of `record`.")
    ],
    start: Annotated[
        float | None,
        typer.Option(help="First time that stays [s]; else the first rest in the liquid."),
    ] = None,
    stop: Annotated[
        float | None, typer.Option(help="Last time that stays [s]; else the last that is seen.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="To be written; without it, only tell what would stay."),
    ] = None,
) -> None:
    """Cut a recording to where the stick was seen, from rest on.

    Times are those of the recording. A simulation starts from rest: a recording that starts in
    motion, or with the stick above the liquid, is refused until it is cut. Of the directory of a
    session that was killed, the recording is made first.
    """
    from ..cut import proposed_cut
    from ..cut import trim as run_trim
    from ..inputs.open import read_recording

    if recording.is_dir():
        from ..hardware import finalise

        recording = finalise(recording)
    whole = read_recording(recording)
    cut = proposed_cut(whole, start, stop)
    kept = f"{cut.start:.3f} to {cut.stop:.3f} s"
    of = f"of {recording}, which lasts from {whole.time[0]:.3f} to {whole.time[-1]:.3f} s"
    if out is None:
        typer.echo(f"would keep {kept} {of}")
        ends = ("--start", f"{cut.start:.3f}", "--stop", f"{cut.stop:.3f}")
        typer.echo(f"next: {command('trim', recording, *ends, '--out', 'FILE.nc')}")
        return
    made = run_trim(recording, start=start, stop=stop, out=out)
    typer.echo(f"{made.path}: {kept} {of}")
    typer.echo(f"next: {command('calibrate', made.path, '--out', 'RUN')}")
