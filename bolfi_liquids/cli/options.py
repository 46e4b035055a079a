"""How commands declare their options: settings whose fields are options, and options shared."""

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer
from pydantic.fields import FieldInfo

from ..errors import InputError
from ..inputs.settings import CalibrationSettings, checked, helped

if TYPE_CHECKING:
    from ..inference.simulations import Compute
    from ..inputs.pour_table import PourTable


def examples(*commands: str, title: str = "For example:", then: str = "") -> str:
    """An epilog, which stands below a command's help.

    Args:
        commands: What is typed after the program's name.
        title: Above them.
        then: A last paragraph.
    """
    # after \b, the lines of a paragraph stay as they are
    listed = "\n".join(("\b", title, *(f"  bolfi-liquids {command}" for command in commands)))
    return f"{listed}\n\n{then}".rstrip()


def grouped(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command whose parameters that are settings become one option for each field.

    Typer reads a function's signature; this one is flat, so that `--help` lists the fields in
    the place of the parameter. Settings check their values by their own rules.

    Args:
        command: Its dataclasses were made by `inputs.settings.checked`; no two fields or
            parameters have one name.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    flat: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        own = parameter.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)
        flat += _of_fields(groups[name]) if name in groups else [own]

    @wraps(command)
    def run(**given: Any) -> Any:
        made = {
            name: group(**{field.name: given.pop(field.name) for field in fields(group)})
            for name, group in groups.items()
        }
        return command(**given, **made)

    run.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in flat}
    del run.__wrapped__  # type: ignore[attr-defined]  # whose signature would be read
    return run


def _of_fields(settings: Any) -> list[inspect.Parameter]:
    """An option for each field."""
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=_typed(_declared(settings, field.name)),
        )
        for field in fields(settings)
    ]


def _declared(settings: Any, name: str) -> FieldInfo:
    return settings.__pydantic_fields__[name]


def _typed(field: FieldInfo) -> Any:
    """Typer's annotation of a setting: several names are one option that is repeated."""
    kind: Any = field.annotation
    extra = field.json_schema_extra
    metavar: Any = extra.get("metavar") if isinstance(extra, dict) else None
    if kind == tuple[str, ...] | None:
        kind = list[str] | None
    if get_origin(kind) is Literal:
        kind, metavar = str, f"<{'|'.join(get_args(kind))}>"
    return Annotated[kind, typer.Option(metavar=metavar, help=_help(field))]


def _help(field: FieldInfo) -> str:
    """What a setting means, and its limits much as typer writes those of other options."""

    def ends(**signs: str) -> list[tuple[Any, str]]:
        rules = [
            (getattr(one, rule, None), signs[rule]) for one in field.metadata for rule in signs
        ]
        return [(end, sign) for end, sign in rules if end is not None]

    low = "".join(f"{end}{sign}" for end, sign in ends(ge="<=", gt="<"))
    high = "".join(f"{sign}{end}" for end, sign in ends(le="<=", lt="<"))
    return f"{field.description}  [{low}x{high}]" if low or high else f"{field.description}"


def typed_options(ctx: typer.Context) -> list[str]:
    """The options that were typed, whatever their values."""
    return [
        parameter.opts[0]
        for parameter in ctx.command.params
        if parameter.opts[0].startswith("--")
        and getattr(ctx.get_parameter_source(str(parameter.name)), "name", "") == "COMMANDLINE"
    ]


def check_needed(ctx: typer.Context, needed: str, *options: str) -> None:
    """Refuse options that were typed without the one that gives them a meaning."""
    typed = typed_options(ctx)
    for option in options:
        if option in typed and needed not in typed:
            raise InputError(
                f"needs {needed}, which is missing",
                where=option,
                fix=f"give {needed}, or leave {option} out",
            )


def check_one(ctx: typer.Context, one: str, other: str) -> None:
    """Refuse two options that exclude each other."""
    if {one, other} <= set(typed_options(ctx)):
        raise InputError(f"excludes {other}", where=one, fix="give one of both")


@checked()
class ComputeOptions:
    """Where simulations run, and for how long at the most.

    Attributes:
        workers: Number of processes; 1 is this process, None one for each processor.
        dask: Address of a Dask scheduler, in place of processes.
        timeout: Seconds that one simulation may take; None sets no limit.
    """

    workers: Annotated[int | None, helped("Processes that simulate; 1 is this process.", ge=1)] = 1
    dask: Annotated[
        str | None, helped("Of a Dask scheduler to simulate on.", metavar="ADDRESS")
    ] = None
    timeout: Annotated[float | None, helped("Seconds that one simulation may take.", gt=0)] = None

    @contextmanager
    def opened(self) -> "Iterator[Compute]":
        """With the executor that `workers` and `dask` name; it is closed afterwards.

        Raises:
            InputError: Both are given, or see `run.compute.open_compute`.
            ValueError, ImportError, ConnectionError: Likewise.
        """
        from ..run.compute import open_compute, processes

        if self.dask is not None and self.workers not in (None, 1):
            what = "names another place to simulate than --workers"
            raise InputError(what, where="--dask", fix="give one of both")
        made = processes(self.workers) if self.dask is None else nullcontext(self.dask)
        with made as workers, open_compute(workers, self.timeout) as compute:
            yield compute

    @contextmanager
    def arguments(self) -> "Iterator[dict[str, Any]]":
        """Yield the arguments `executor` and `timeout` of a function."""
        with self.opened() as compute:
            yield {"executor": compute.executor, "timeout": compute.timeout}


@checked()
class StudyComputeOptions(ComputeOptions):
    """Those of the demo or a long study, which take all processors unless told otherwise."""

    workers: Annotated[int | None, helped("Processes that simulate; else all.", ge=1)] = None


RunArgument = Annotated[Path, typer.Argument(metavar="RUN", help="Directory of a run.")]
RigOption = Annotated[
    Path | None, typer.Option("--rig", metavar="FILE", help="rig.toml; without it, the bundled.")
]
CupsOption = Annotated[
    Path | None,
    typer.Option("--cups", metavar="FILE", help="cups.toml; without it, the bundled one."),
]
ParticlesOption = Annotated[
    int, typer.Option("--particles", help=_help(_declared(CalibrationSettings, "particles")))
]
LiquidOption = Annotated[
    str | None,
    typer.Option("--liquid", metavar="NAME", help="Whose pours count, if the table has several."),
]
PoursOption = Annotated[
    Path | None,
    typer.Option(metavar="TABLE", help="What pours of the liquid spilled: they count in pour."),
]
BaselineOption = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE",
        help="Recording of any liquid without an effect, or what `baseline` made of several: shows "
        "the simulator's own error. Repeatable.",
    ),
]


def opened_pours(path: Path | None, liquid: str | None) -> "PourTable | None":
    """The pours of one liquid in a table; None without one."""
    from ..inputs.pour_table import open_pours

    return None if path is None else open_pours(path, liquid)
