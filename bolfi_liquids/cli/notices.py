"""What the package logs, printed on stderr as plain lines."""

import logging
import sys

PACKAGE = "bolfi_liquids"


class _ToStderr(logging.Handler):
    """Writes to what `sys.stderr` is at the time, which a test or a caller may have replaced."""

    def emit(self, record: logging.LogRecord) -> None:
        print(self.format(record), file=sys.stderr)


def print_notices() -> None:
    """Have the package's notices printed; a second call changes nothing."""
    logger = logging.getLogger(PACKAGE)
    if any(isinstance(handler, _ToStderr) for handler in logger.handlers):
        return
    logger.addHandler(_ToStderr(logging.INFO))
    logger.setLevel(logging.INFO)
