"""The README's Python runs as it is printed; `test_record_on_emulator` runs what records."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"
BLOCKS = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


def test_the_readme_has_examples():
    assert len(BLOCKS) >= 2


@pytest.mark.slow
def test_blocks_run_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    reader = {"__name__": "__main__"}
    for block in BLOCKS:
        # "runs/mine" is of recordings that a reader has
        if "runs/mine" not in block and "bl.record(" not in block:
            exec(compile(block, str(README), "exec"), reader)
