"""What the package logs, printed on stderr as plain lines."""

import logging
import sys

PACKAGE = "bolfi_liquids"


class _ToStderr(logging.Handler):
    """Writes to what `sys.stderr` is at the time, which a test or a caller may have replaced."""

    def emit(self, record: logging.LogRecord) -> None:
        print(self.format(record), file=sys.stderr)


_TO_STDERR = _ToStderr()


def print_notices() -> None:
    """Have the package's notices printed; a second call changes nothing."""
    logger = logging.getLogger(PACKAGE)
    logger.addHandler(_TO_STDERR)
    logger.setLevel(logging.INFO)
