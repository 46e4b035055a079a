"""The README's Python runs as it is printed."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"
BLOCKS = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


def test_the_readme_has_examples():
    assert len(BLOCKS) >= 2


@pytest.mark.slow
@pytest.mark.alone  # one of them records on the emulator
def test_blocks_run_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    reader = {"__name__": "__main__"}
    for block in BLOCKS:
        if "runs/mine" not in block:  # those are of recordings that a reader has
            exec(compile(block, str(README), "exec"), reader)
