import math

from bolfi_liquids.hardware.board import Board, Row, Trouble, Who
from bolfi_liquids.hardware.process import REAL_CLOCK


def test_rows_are_empty_at_first_and_apart():
    board = Board()
    assert board.read(Who.CONTROL).age(REAL_CLOCK.now()) == math.inf
    board.write(Who.CAMERA_XZ, Row(5.0, Trouble.SOURCE_LOST, 7, 30.0, 0.1, 0.04))
    assert board.read(Who.CAMERA_XZ) == (5.0, Trouble.SOURCE_LOST, 7, 30.0, 0.1, 0.04)
    assert board.read(Who.CAMERA_XZ).age(6.5) == 1.5
    for who in (Who.CONTROL, Who.RECORDER, Who.CAMERA_YZ):
        assert board.read(who).beat == 0.0
