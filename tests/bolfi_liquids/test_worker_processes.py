"""Processes that share long work."""

import subprocess
import sys

WORKING = """
import os, time
from bolfi_liquids.worker_processes import processes

with processes(2) as pool:
    pool.submit(time.sleep, 300)
    assert pool.submit(os.getpid).result() != os.getpid()
    print("started", flush=True)
    time.sleep(300)
"""


def test_workers_busy_or_idle_end_with_a_parent_that_is_killed():
    run = subprocess.Popen([sys.executable, "-c", WORKING], stdout=subprocess.PIPE)
    assert run.stdout is not None
    assert run.stdout.readline() == b"started\n"
    run.kill()
    rest, _ = run.communicate(timeout=60.0)  # until nobody holds the pipe
    assert rest == b""
