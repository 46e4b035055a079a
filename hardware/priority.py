"""Making a process punctual, as far as the system lets it."""

import gc
import os
import sys

FIFO_PRIORITY = 20
CONTROL_NICENESS = -10
BEFORE_OTHERS = -5
SWITCH_INTERVAL = 5e-4  # s; the thread that checks orders must not hold up the loop


def come_first() -> None:
    """Ask for a better priority than that of what may wait, such as inference; if permitted."""
    try:
        os.nice(BEFORE_OTHERS)
    except OSError:
        pass


def quieten() -> None:
    """Keep Python's own pauses away; takes some hundredths of a second."""
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(SWITCH_INTERVAL)


def hurry() -> str:
    """Ask for a real-time or a better priority for this thread.

    Not to be called before ur_rtde has nothing to wait for: it waits without sleeping.

    Returns:
        What was granted: "fifo", "nice" or "normal".
    """
    try:
        # threads that this one starts must not inherit it
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(FIFO_PRIORITY))
        return "fifo"
    except (OSError, AttributeError):  # not permitted; or a system without it
        pass
    try:
        os.nice(CONTROL_NICENESS)
        return "nice"
    except OSError:
        return "normal"
