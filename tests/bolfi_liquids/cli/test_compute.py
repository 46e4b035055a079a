"""Options that say where a command simulates, and groups of options."""

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from bolfi_liquids.cli.app import app
from bolfi_liquids.cli.compute import Compute, open_executor_of
from bolfi_liquids.cli.grouped import grouped

SIMULATING = ("calibrate", "criticise", "pour", "demo", "reproduce", "check sbc", "check physics",
              "simulate stir", "simulate pour")  # fmt: skip


@pytest.mark.parametrize("command", SIMULATING)
def test_every_command_that_simulates_says_where(command):
    result = CliRunner().invoke(app, [*command.split(), "--help"], env={"COLUMNS": "120"})
    assert result.exit_code == 0
    assert "--workers" in result.stdout and "--dask" in result.stdout


def test_one_worker_is_this_process():
    with Compute().executor() as executor:
        assert executor is None


def test_two_places_at_once_are_refused():
    with pytest.raises(typer.BadParameter, match="--workers and --dask"):
        with open_executor_of(2, "tcp://127.0.0.1:9"):
            pass


@dataclass(frozen=True)
class Size:
    width: Annotated[int, typer.Option(help="In cm.")] = 3
    height: Annotated[int | None, typer.Option(help="In cm.")] = None


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
