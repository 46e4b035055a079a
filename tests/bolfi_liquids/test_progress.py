"""Progress is shown on terminals alone; what was made before is not counted again."""

import sys

import pytest
import rich.console
from bolfi_liquids.inference import progress

from bolfi_liquids.progress import after_first, phases, progress_bar


def test_only_steps_after_the_first_ones_move_the_bar():
    for kept, steps, seen in (
        (0, [1, 1, 2], [1, 1, 2]),
        (3, [1, 1, 2, 3], [1, 3]),
        (9, [4, 4], []),
        (2, [5], [3]),
    ):
        moved = []
        advance = after_first(kept, moved.append)
        for one in steps:
            advance(one)
        assert moved == seen


@pytest.mark.parametrize(
    ("shown", "terminal", "words"),
    [
        (False, True, []),
        (True, False, ["search: 5 to run", "checks: 2 to run"]),
        (True, True, ["checks", "1/2", "0:00:00"]),
    ],
)
def test_phases_take_over_a_terminal_only_where_they_are_shown(
    shown, terminal, words, capsys, monkeypatch
):
    monkeypatch.setattr(rich.console.Console, "is_terminal", terminal)
    streams = sys.stdout, sys.stderr
    with phases(shown=shown) as report:
        assert ((sys.stdout, sys.stderr) == streams) is not (shown and terminal)
        print("of the caller")
        report("search", 0, 5)
        report("search", 3, 5)
        report("checks", 0, 2)
        report("checks", 1, 2)
    told = capsys.readouterr()
    assert "of the caller" in told.out + told.err
    assert all(word in told.err for word in words) and bool(told.err) is bool(words)


def test_without_a_terminal_a_long_phase_says_how_far_it_is(capsys, monkeypatch):
    monkeypatch.setattr(progress, "LINES_APART", 0.0)
    with progress_bar("stirs", 4, shown=True, done=1, bound="at least") as advance:
        for _ in range(4):
            advance(1)
    told = capsys.readouterr().err.splitlines()
    assert told == [
        "stirs: 3 to run at least",
        *(f"stirs, {n} of {max(n, 4)}" for n in (2, 3, 4, 5)),
    ]
