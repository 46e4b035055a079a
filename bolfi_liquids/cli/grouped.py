"""Options that are declared as the fields of a frozen dataclass."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer
from pydantic.dataclasses import is_pydantic_dataclass
from pydantic.fields import FieldInfo


def grouped(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command whose parameters that are dataclasses become one option for each field.

    Typer reads a function's signature; this one is flat, so that `--help` lists the fields in
    the place of the parameter.

    Args:
        command: A dataclass is one of `inputs.settings`, or its fields carry Typer's annotations;
            no two fields or parameters have one name.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters = inspect.signature(command).parameters
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    flat: list[inspect.Parameter] = []
    for name, parameter in parameters.items():
        if name in groups:
            flat += _of_fields(groups[name])
        else:
            flat.append(parameter.replace(annotation=hints[name]))

    @wraps(command)
    def run(**given: Any) -> Any:
        made = {
            name: group(**{field.name: given.pop(field.name) for field in fields(group)})
            for name, group in groups.items()
        }
        return command(**given, **made)

    keyword = inspect.Parameter.KEYWORD_ONLY
    flat = [parameter.replace(kind=keyword) for parameter in flat]
    run.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in flat}
    del run.__wrapped__  # type: ignore[attr-defined]  # whose signature would be read
    return run


def _of_fields(group: Any) -> list[inspect.Parameter]:
    """An option for each field; those of settings check their values by their own rules."""
    if is_pydantic_dataclass(group):
        hints = {field.name: _typed(setting(group, field.name)) for field in fields(group)}
    else:
        hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(group)
    ]


def setting(settings: Any, name: str) -> FieldInfo:
    """How a setting is declared."""
    return settings.__pydantic_fields__[name]


def _typed(field: FieldInfo) -> Any:
    """Typer's annotation of a setting: several names are one option that is repeated."""
    kind: Any = field.annotation
    if kind == tuple[str, ...] | None:
        return Annotated[list[str] | None, typer.Option(help=field.description)]
    if get_origin(kind) is Literal:
        choices = "|".join(get_args(kind))
        return Annotated[str, typer.Option(metavar=choices, help=field.description)]
    return Annotated[kind, typer.Option(help=field.description)]
