"""Where and of which code a figure was taken."""

import platform
import subprocess
from datetime import date
from pathlib import Path


def machine() -> str:
    """Date, processor and commit, in one line."""
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=False,
    ).stdout.strip()
    return f"{date.today()}, {platform.machine()} {processor()}, commit {commit}"


def processor() -> str:
    """As the system names it, where it does."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()
