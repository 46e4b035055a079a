"""The command `import`: recordings that were made elsewhere."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..wording import command
from .options import examples

EPILOG = examples("import --template columns.toml", "import stir.csv --columns columns.toml")


def import_table(
    table: Annotated[
        Path | None, typer.Argument(metavar="TABLE", help="CSV: a header, and a row each sample.")
    ] = None,
    columns: Annotated[
        Path | None, typer.Option(metavar="FILE", help="columns.toml: what stands where.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The recording; without it, TABLE's .nc.")
    ] = None,
    template: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Only write a columns.toml to change.")
    ] = None,
) -> None:
    """Make a recording of a table, whatever its columns and units.

    First write a template; change it to say what stands where in your table; then import.
    """
    from ..files import existing_file
    from ..inputs.bundled import write_template
    from ..inputs.table_import import import_table as run_import
    from ..inputs.table_import import outline

    if template is not None:
        written = write_template("columns.toml", template)
        then = command("import", "TABLE", "--columns", written)
        typer.echo(f"{written}: change it, then: {then}")
        return
    if table is None or columns is None:
        missing = "TABLE" if table is None else "--columns"
        fix = "give TABLE and --columns FILE, or --template FILE"
        raise InputError("is missing", where=missing, fix=fix)
    table = existing_file(table)
    recording = run_import(table, columns, table.with_suffix(".nc") if out is None else out)
    typer.echo(outline(recording))
    typer.echo(f"next: {command('calibrate', recording.path, '--out', 'RUN')}")
