"""The README's commands and Python run as they are printed; `test_record_on_emulator` records."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
LANGUAGE = re.compile(r"```(\w*)\n(.*?)```", re.DOTALL)


def blocks(section, language):
    """Blocks of code of a section."""
    text = README.split(f"\n## {section}\n")[1].split("\n## ")[0]
    return [block for of, block in LANGUAGE.findall(text) if of == language]


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A directory that holds what is bundled, as a clone's root does."""
    (tmp_path / "bolfi_liquids").mkdir()
    (tmp_path / "bolfi_liquids" / "data").symlink_to(ROOT / "bolfi_liquids" / "data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_engines_example_prints_what_the_text_says(clone, capsys):
    (block,) = blocks("Your own simulator", "python")
    exec(compile(block, "README.md", "exec"), {"__name__": "__main__"})
    status, sampled, ends = capsys.readouterr().out.split("\n", 2)
    assert (status, sampled) == ("fitted", "converged")
    told = re.search(r"the quantiles\s+([\d.]+), ([\d.]+) and ([\d.]+),", README).groups()
    found = [float(end) for end in ends.strip().strip("[]").split()]
    assert found == pytest.approx([float(end) for end in told], abs=0.02)


@pytest.mark.minutes
def test_commands_and_python_of_a_recording_run_word_for_word(clone):
    (commands,) = blocks("Your own recording", "")
    path = f"PATH={Path(sys.executable).parent}:$PATH"
    subprocess.run(["bash", "-ec", f"export {path}\n{commands}"], cwd=clone, check=True)
    (block,) = blocks("Your own recording", "python")
    exec(compile(block, "README.md", "exec"), {"__name__": "__main__"})
    for run in ("mine", "glycerin"):
        assert (clone / "runs" / run / "report.html").is_file()
