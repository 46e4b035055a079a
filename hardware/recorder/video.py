"""Videos that can be read up to the last picture, however their writer ended."""

import errno
import io
import math
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from ..csv_file import BackgroundSync, write_all
from ..errors import missing_extra

_TICK = Fraction(1, 1000)  # Matroska's own unit of time [s]
_QUALITY = 2  # MJPEG's best: blocks of a coarser one move a line's edge


class VideoWriter:
    """Writes grey pictures to a Matroska file as Motion JPEG, each with its own time.

    Each picture goes to the file at once: a writer that is killed loses the one in hand.

    Raises:
        ImportError: PyAV is not installed.
        OSError: The file cannot be made.
    """

    def __init__(self, path: Path, *, size: tuple[int, int], rate: float):
        try:
            import av
        except ImportError as err:
            raise missing_extra("PyAV", "cameras", "Recording a video") from err
        width, height = size
        # opened here: PyAV's own files cannot be brought to the disk
        self._file = _WholeWrites(path, "wb")
        self._container: Any = av.open(
            self._file,
            "w",
            format="matroska",
            options={"cluster_time_limit": "300", "flush_packets": "1"},
        )
        stream: Any = self._container.add_stream(
            "mjpeg", rate=Fraction(rate).limit_denominator(1000)
        )
        stream.width, stream.height = width, height
        stream.pix_fmt = "yuvj420p"
        coder = stream.codec_context
        coder.time_base = _TICK
        coder.qmin = coder.qmax = _QUALITY
        coder.thread_count = 1  # threads would keep pictures back
        self._stream = stream
        self._shape = (height, width)
        self._first: float | None = None
        self._last = -1
        self._sync = BackgroundSync(self._file.fileno())

    def write(self, image: np.ndarray, stamp: float) -> None:
        """Append a picture.

        Args:
            image: Grey levels, uint8, shape (height, width).
            stamp: Its time [s]; the video's counts from the first, in whole milliseconds.

        Raises:
            OSError: The file cannot take it.
            ValueError: The picture has another shape or type.
        """
        from av import VideoFrame

        if image.shape != self._shape or image.dtype != np.uint8:
            raise ValueError(
                f"a picture has shape {image.shape} and type {image.dtype}, the video "
                f"{self._shape} and uint8; set the camera's width and height in rig.toml"
            )
        # a clock that stands or goes back, or a stamp that is no number, must not spoil the file
        self._last += 1
        if math.isfinite(stamp):
            self._first = stamp if self._first is None else self._first
            self._last = max(self._last, round((stamp - self._first) / _TICK))
        picture: Any = VideoFrame.from_ndarray(image, format="gray")
        picture.pts, picture.time_base = self._last, _TICK
        with _os_errors():
            self._mux(picture)
        self._sync.check()

    def close(self) -> None:
        """End the file; may be called again.

        Raises:
            OSError: The file cannot take its end; it can be read without.
        """
        if self._file.closed:
            return
        try:
            with _os_errors():
                self._mux(None)
                self._container.close()
        finally:
            self._sync.close()
            self._file.close()

    def _mux(self, picture: Any) -> None:
        for packet in self._stream.encode(picture):
            self._container.mux(packet)


@contextmanager
def _os_errors() -> Iterator[None]:
    """After a file's first error FFmpeg repeats it as one of its own, which is no OSError."""
    from av.error import FFmpegError

    try:
        yield
    except FFmpegError as err:
        raise OSError(errno.EIO, f"the video cannot be written ({err.strerror})") from err


class _WholeWrites(io.FileIO):
    """FFmpeg takes a write for done that a disk which gets full has done in part."""

    def write(self, data: Any, /) -> int:
        write_all(self.fileno(), data)
        return len(data)
