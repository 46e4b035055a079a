"""A camera's process: it writes down each picture, and what the picture tells, at once."""

import os
from collections.abc import Callable
from contextlib import closing
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Event, Thread
from typing import NamedTuple

import numpy as np

from ..board import Board, Row, Trouble, Who, host_time
from ..cameras.base import CameraError, FrameSource
from ..csv_file import CsvAppender
from ..process import come_first, leave_signals_to_main
from ..recorder.directory import frames_file, video_file
from ..recorder.events import Disk, writing
from ..recorder.video import VideoWriter
from ..rig import Rig, View
from ..vision.frame import Flag, Frame, FrameMeasurement, line_is_good, stamp_fault
from ..vision.measuring import FrameMeter
from ..vision.stick_view import stick_view

SAME_PICTURES = 3  # in a row; a camera's noise makes no two alike
RATE_SECONDS = 2.0  # [s]; a camera that slows down shows its new rate after these
CLOSING_SECONDS = 0.3  # [s]; how long a camera that does not answer may hold up the end
WHO: dict[View, Who] = {"xz": Who.CAMERA_XZ, "yz": Who.CAMERA_YZ}


def run_camera(
    rig: Rig,
    view: View,
    make_camera: Callable[[], FrameSource],
    board: Board,
    main: Connection,
    directory: Path,
) -> None:
    """Read a camera until main lets go; write each picture and its measurement.

    Pictures are read, measured and written one after the other. Where that falls behind, the
    driver's queue holds some and drops others: a camera that counts them leaves their `index`
    out, and the stamps tell of others. The sign of life is given at each
    picture that differs from the one before, so that a camera that hangs, and one that repeats
    itself, look dead.

    Args:
        rig: Its sizes tell what to look for.
        view: Which of its cameras this is.
        make_camera: Opens it; called in this process.
        board: Where to leave signs of life.
        main: Any message or its end means: finish.
        directory: Of the session; it exists.

    Raises:
        OSError: Not even an event can be written at the start.
        RigError: The camera's lens cannot be used.
        ImportError: OpenCV or PyAV is not installed.
    """
    leave_signals_to_main()
    come_first()
    with writing(directory, f"camera_{view}") as disk:
        process = _CameraProcess(rig, view, board, disk, directory)
        leaving, answered = Event(), Event()
        Thread(target=_wait_for_end, args=(main, leaving, answered, process), daemon=True).start()
        process.follow(make_camera, leaving)
        answered.set()
        process.finish()
        process.tell_end()


def _wait_for_end(
    main: Connection, leaving: Event, answered: Event, process: "_CameraProcess"
) -> None:
    """A camera that blocks cannot be interrupted: its process then ends without it."""
    main.poll(None)
    leaving.set()
    if not answered.wait(CLOSING_SECONDS):
        process.tell_end("the camera does not answer")
        os._exit(1)  # what was written is in the files; the video can be read without its end


class _Tally(NamedTuple):
    """Counts of the pictures so far."""

    row: Row = Row()  # as it goes to the board; its beat is when the last new picture came
    came: tuple[float, ...] = ()  # when those of the last seconds came [s]
    last: int = -1  # index of the last picture
    lost: int = 0
    same: int = 1  # times that the last picture has come in a row


def tallied(tally: _Tally, seen: FrameMeasurement, now: float) -> _Tally:
    """Count another picture, which came at `now` [s]."""
    before = tally.row
    came = (*(time for time in tally.came if time > now - RATE_SECONDS), now)
    row = before._replace(
        count=before.count + 1,
        rate=(len(came) - 1) / (now - came[0]) if now > came[0] else 0.0,
        value=seen.angle if line_is_good(seen.flags) else float("nan"),
    )
    same = tally.same + 1
    if not seen.flags & Flag.REPEATED_IMAGE:
        between = now - before.beat if before.beat else 0.0
        row, same = row._replace(beat=now, worst=max(before.worst, between)), 1
    lost = tally.lost + max(seen.index - tally.last - 1, 0)
    return _Tally(row, came, seen.index, lost, same)


class _CameraProcess:
    def __init__(self, rig: Rig, view: View, board: Board, disk: Disk, directory: Path):
        self._view: View = view
        self._board = board
        self._disk = disk
        self._trouble = Trouble.NONE
        self._tally = _Tally()
        self._stamps: tuple[float, float] | None = None  # the first and the latest [s]
        self._meter = FrameMeter(stick_view(rig, view))
        camera, table, video = rig.camera(view), frames_file(view), video_file(view)
        size = (camera.width, camera.height)
        self._table = disk.write(
            table, lambda: CsvAppender(directory / table, FrameMeasurement._fields)
        )
        self._video = disk.write(
            video, lambda: VideoWriter(directory / video, size=size, rate=camera.rate)
        )

    def follow(self, make_camera: Callable[[], FrameSource], leaving: Event) -> None:
        """Take pictures until the end, or until the camera gives no more."""
        try:
            with closing(make_camera()) as camera:
                while not leaving.is_set():
                    frame = camera.read()
                    if frame is None:
                        self._lose("it gives no more pictures")
                        break
                    self._take(frame, host_time())
        except (CameraError, ValueError, OSError) as err:
            self._lose(str(err))
        leaving.wait()

    def finish(self) -> None:
        """Bring everything to the disk."""
        table, video = self._table, self._video
        if video is not None:
            self._disk.write(video_file(self._view), video.close)
        if table is not None:
            self._disk.write(frames_file(self._view), table.sync)
            table.close()

    def tell_end(self, reason: str = "") -> None:
        """Write the last event."""
        tally = self._tally
        self._disk.tell("left", frames=int(tally.row.count), lost=tally.lost, reason=reason)

    def _take(self, frame: Frame, came: float) -> None:
        row = self._meter.measure(frame)
        self._keep(frame, row)
        self._watch_stamp(frame)
        self._tally = tallied(self._tally, row, came)
        if self._tally.same == SAME_PICTURES:
            reason = f"the same picture came {SAME_PICTURES} times in a row"
            self._complain(Trouble.SAME_PICTURE, reason=reason, index=frame.index)
        self._beat()

    def _watch_stamp(self, frame: Frame) -> None:
        """Complain of the first stamp that does not rise; long steps trip the guard of its age."""
        first, before = self._stamps or (frame.stamp, -np.inf)
        self._stamps = first, frame.stamp
        if not frame.stamp > before and self._trouble is Trouble.NONE:
            reason = stamp_fault(frame.stamp - before, frame.index, before - first)
            self._complain(Trouble.BAD_STAMPS, reason=reason, index=frame.index)

    def _keep(self, frame: Frame, row: FrameMeasurement) -> None:
        table, video = self._table, self._video
        if table is not None:
            self._disk.write(frames_file(self._view), partial(table.append, [row]))
        if video is not None:
            self._disk.write(video_file(self._view), partial(video.write, frame.image, frame.stamp))

    def _lose(self, reason: str) -> None:
        self._complain(Trouble.SOURCE_LOST, reason=reason)
        self._beat()

    def _complain(self, trouble: Trouble, **fields: float | str) -> None:
        # it stays on the board: nothing that stopped an arm resumes by itself
        self._trouble = trouble
        self._disk.tell(trouble.kind, **fields)

    def _beat(self) -> None:
        row = self._tally.row._replace(trouble=self._disk.trouble or self._trouble)
        self._board.write(WHO[self._view], row)
