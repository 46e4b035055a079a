"""Progress is shown on terminals, and elsewhere in a line now and then."""

import sys

import pytest
import rich.console
from bolfi_liquids.inference import progress

from bolfi_liquids.progress import phases, progress_bar


@pytest.mark.parametrize(
    ("shown", "terminal", "words"),
    [
        (False, True, []),
        (True, False, ["search, 0 of 5", "checks, 0 of 2"]),
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
    assert told == [f"stirs, {n} of at least {max(n, 4)}" for n in (1, 2, 3, 4, 5)]
