"""Options that say where a command simulates, and groups of options."""

from typing import Annotated

import pytest
import typer
from typer.main import get_command
from typer.testing import CliRunner

from bolfi_liquids.cli.app import app
from bolfi_liquids.cli.options import ComputeOptions, grouped
from bolfi_liquids.inputs.settings import checked, helped

ELSEWHERE = {"import", "guide", "record", "trim"}
"""Commands that simulate nothing, or in real time beside an arm."""


def simulating(command=None, words=()):
    """Words of every command but those of `ELSEWHERE` and of the group `rig`."""
    command = get_command(app) if command is None else command
    for name, child in command.commands.items():
        if getattr(child, "commands", None) and name != "rig":
            yield from simulating(child, (*words, name))
        elif name not in {*ELSEWHERE, "rig"}:
            yield (*words, name), child


@pytest.mark.parametrize(
    "command", [pytest.param(child, id=" ".join(words)) for words, child in simulating()]
)
def test_every_command_that_simulates_says_where_and_for_how_long(command):
    options = {name for parameter in command.params for name in parameter.opts}
    assert options >= {"--workers", "--dask", "--timeout"}


def test_commands_are_found_in_their_groups():
    found = {" ".join(words) for words, _ in simulating()}
    assert found >= {"calibrate", "report", "check sbc", "simulate stir"}


def test_one_worker_is_this_process():
    with ComputeOptions().opened() as compute:
        assert compute.executor is None


def test_two_places_at_once_are_refused():
    with pytest.raises(typer.BadParameter, match="--workers and --dask"):
        with ComputeOptions(2, "tcp://127.0.0.1:9").opened():
            pass


@checked()
class Size:
    width: Annotated[int, helped("In cm.")] = 3
    height: Annotated[int | None, helped("In cm.")] = None


def test_a_group_becomes_options_and_arrives_whole():
    app, seen = typer.Typer(), []

    @app.command()
    @grouped
    def draw(
        name: Annotated[str, typer.Argument()], size: Size, loud: Annotated[bool, typer.Option()]
    ) -> None:
        seen.append((name, size, loud))

    assert CliRunner().invoke(app, ["box", "--height", "7", "--loud"]).exit_code == 0
    assert CliRunner().invoke(app, ["box", "--no-loud", "--width", "1"]).exit_code == 0
    assert CliRunner().invoke(app, ["box", "--loud", "--depth", "7"]).exit_code == 2
    assert seen == [("box", Size(3, 7), True), ("box", Size(1, None), False)]
