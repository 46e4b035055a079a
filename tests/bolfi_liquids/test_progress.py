"""Progress is shown on terminals alone; what was made before is not counted again."""

import sys

import pytest
import rich.console

from bolfi_liquids.progress import after_first, phases


@pytest.mark.parametrize(
    ("kept", "steps", "seen"),
    [(0, [1, 1, 2], [1, 1, 2]), (3, [1, 1, 2, 3], [1, 3]), (9, [4, 4], []), (2, [5], [3])],
)
def test_only_steps_after_the_first_ones_move_the_bar(kept, steps, seen):
    moved = []
    advance = after_first(kept, moved.append)
    for one in steps:
        advance(one)
    assert moved == seen


@pytest.mark.parametrize(
    ("shown", "terminal", "words"),
    [
        (False, True, []),
        (False, False, []),
        (True, False, ["search (after 0 simulations)", "checks (after 3 simulations)"]),
        (True, True, ["checks (4 simulations)", "0:00:00"]),
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
        report("search", 3)
        report("checks", 1)
    told = capsys.readouterr()
    assert "of the caller" in told.out + told.err
    assert all(word in told.err for word in words) and bool(told.err) is bool(words)
