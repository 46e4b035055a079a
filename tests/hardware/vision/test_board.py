import math
import time

from bolfi_liquids.hardware.board import SPAWN, Board, Row, Trouble, Who, host_time
from bolfi_liquids.hardware.recorder.process import run_recorder


def test_rows_are_empty_at_first_and_apart():
    board = Board()
    assert board.read(Who.CONTROL).age(host_time()) == math.inf
    board.write(Who.CAMERA_XZ, Row(5.0, Trouble.SOURCE_LOST, 7, 30.0, 0.1, 0.04))
    assert board.read(Who.CAMERA_XZ) == (5.0, Trouble.SOURCE_LOST, 7, 30.0, 0.1, 0.04)
    assert board.read(Who.CAMERA_XZ).age(6.5) == 1.5
    for who in (Who.CONTROL, Who.RECORDER, Who.CAMERA_YZ):
        assert board.read(who).beat == 0.0


def test_another_process_s_signs_of_life_are_fresh_and_stand_still_when_it_is_killed(tmp_path):
    board = Board()
    receive, samples = SPAWN.Pipe(duplex=False)
    theirs, main = SPAWN.Pipe()
    process = SPAWN.Process(target=run_recorder, args=(board, receive, theirs, tmp_path))
    process.start()
    try:
        deadline = time.monotonic() + 30
        while not board.read(Who.RECORDER).beat and time.monotonic() < deadline:
            time.sleep(0.01)
        beats = []
        for _ in range(50):
            row = board.read(Who.RECORDER)
            assert 0 <= row.age(host_time()) < 5.0  # the host's clock is shared
            beats.append(row.beat)
            time.sleep(0.005)
        assert beats == sorted(beats) and beats[-1] > beats[0]
    finally:
        process.kill()
        process.join()
        for end in (receive, samples, theirs, main):
            end.close()
    last = board.read(Who.RECORDER)
    time.sleep(0.1)
    assert board.read(Who.RECORDER).beat == last.beat > 0
    assert last.age(host_time()) > 0.1
