import math

from bolfi_liquids.hardware.board import Row, Trouble, Who
from bolfi_liquids.hardware.robot.orders import Stopped
from bolfi_liquids.hardware.session.live import Reading, live_table
from bolfi_liquids.hardware.session.processes import Status
from rich.console import Console

ROWS = (
    Row(10.0, Trouble.NONE, 1250, 124.9, 0.42, 0.0032),
    Row(9.97, Trouble.NONE, 1245, 125.1, math.nan, 0.004),
    Row(9.98, Trouble.NONE, 300, 29.97, 0.05, 0.035),
    Row(9.96, Trouble.NONE, 301, 29.95, -0.02, 0.035),
)


def status_of(rows, *guards, stopped=None):
    return Status(dict(zip(Who, rows, strict=True)), guards, None, (), (), stopped, False)


def shown(title, status):
    console = Console(width=80, color_system=None)
    with console.capture() as capture:
        console.print(live_table(title, status, 10.0))
    lines = capture.get().splitlines()
    assert max(map(len, lines)) <= 80
    return {line.split("  ")[0].strip(): line for line in lines}


def test_all_is_shown_in_80_columns():
    guards = (Reading("force", 4.0, 20.0, "N"), Reading("tracking", 0.02, 0.01, "m"))
    lines = shown("star, cycle 1 of 3", status_of(ROWS, *guards))
    assert any("star, cycle 1 of 3" in line for line in lines.values())
    assert "42 %" in lines["path"]
    assert "+2.86°" in lines["stick"] and "-1.15°" in lines["stick"]
    assert "3.2 ms late" in lines["loop"]
    assert "30.0 /s" in lines["camera xz"] and "20 ms ago" in lines["camera xz"]
    assert "1245 rows" in lines["recorder"]
    assert "80 % left" in lines["force"]
    assert "passed" in lines["tracking"]
    assert "stopped" not in lines


def test_trouble_takes_the_place_of_numbers():
    rows = (*ROWS[:3], ROWS[3]._replace(trouble=Trouble.SAME_PICTURE, value=math.nan))
    stopped = Stopped("camera yz shows the same picture", "camera yz")
    lines = shown("star", status_of(rows, stopped=stopped))
    assert "same picture again" in lines["camera yz"]
    assert "yz not seen" in lines["stick"]
    assert "camera yz shows" in lines["stopped"]


def test_a_guard_changes_its_colour_before_it_stops_the_arm_and_an_old_sign_of_life_is_red():
    for value, style in ((4.0, "green"), (17.0, "yellow"), (20.0, "red"), (30.0, "red")):
        table = live_table("", status_of(ROWS, Reading("force", value, 20.0, "N")), 10.0)
        assert list(table.columns[1].cells)[-1].style == style
    rows = (ROWS[0]._replace(beat=9.0), *ROWS[1:])
    cells = list(live_table("", status_of(rows), 10.0).columns[1].cells)
    assert (cells[3].style, cells[4].style) == ("red", "green")
