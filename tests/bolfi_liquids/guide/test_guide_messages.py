"""Messages that troubleshooting.md quotes are those that people get."""

import ast
import re
import shutil
from importlib.resources import files
from itertools import groupby
from pathlib import Path

import pytest
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids import hardware, inference, models
from bolfi_liquids.cli.app import app
from bolfi_liquids.guide import read_page

HEADING = re.compile(r"^### (`+) ?(?P<message>.*?) ?\1$", re.MULTILINE)
QUOTED = [match["message"] for match in HEADING.finditer(read_page("troubleshooting"))]
VARYING = re.compile(r"%[sd]|\{[{%]?.*?[%}]?\}|`|;|\.\s|\n", re.DOTALL)
"""Places of a text in the source at which a message has something else."""

MAX_FOREIGN = 3
"""Words in a row that no text of the source has: a file's name, an effect, a liquid."""

ELSEWHERE = (
    "A process in the process pool was terminated abruptly while the future was running or",
    "Timed out trying to connect to",
    "No such command",
    "No space left on device",
)
"""Said by other libraries, and by the system."""


def texts_of_the_source():
    """Whatever stands between two places that vary, of every text in sources and templates."""
    found = set(ELSEWHERE)
    for path in {
        path
        for package in (bl, hardware, inference, models)
        for path in Path(package.__path__[0]).rglob("*")
    }:
        if path.suffix == ".py":
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    found.update(VARYING.split(node.value))
        elif path.suffix == ".jinja":
            found.update(VARYING.split(path.read_text("utf-8")))
    return {" ".join(text.split()) for text in found}


def foreign_words(message, texts):
    """The longest row of words in a message that stand in none of the texts."""
    known = [False] * len(message)
    for text in texts:
        if " " in text and (start := message.find(text)) >= 0:
            known[start : start + len(text)] = [True] * len(text)
    words = [
        ("" if all(known[word.start() : word.end()]) else word[0])
        for word in re.finditer(r"\S+", message)
    ]
    rows = groupby(words, lambda word: bool(re.fullmatch(r"[A-Za-z]{2,}[,;:]?", word)))
    return max((list(row) for plain, row in rows if plain), key=len, default=[])


def test_what_is_quoted_stands_in_the_source():
    texts = texts_of_the_source()
    foreign = {message: foreign_words(message, texts) for message in QUOTED}
    assert not {message: row for message, row in foreign.items() if len(row) > MAX_FOREIGN}
    wrong = "error: stir.nc: no such file; look whether the path is right"
    assert len(foreign_words(wrong, texts)) > MAX_FOREIGN


@pytest.fixture
def told(tmp_path, monkeypatch):
    """Runs a command where a recording stir.nc lies; what it says last."""
    monkeypatch.chdir(tmp_path)
    content = (files("bolfi_liquids.data") / "glycerin_v10.nc").read_bytes()
    (tmp_path / "stir.nc").write_bytes(content)

    def run(command):
        result = CliRunner().invoke(app, command.split())
        return (result.stderr.strip().splitlines() or [""])[-1]

    return run


@pytest.fixture
def run(calibration, told, tmp_path):
    """A copy of a calibrated run, runs/mine."""
    return shutil.copytree(calibration.path, tmp_path / "runs" / "mine")


def test_runs_that_cannot_go_on(told, run, calibration):
    assert told("calibrate stir.nc --out runs/mine") in QUOTED
    options = "--budget 7 --batch 2 --seed 3 --particles 200 --resume"
    assert told(f"calibrate stir.nc --out runs/mine {options}") in QUOTED
    whole = (run / "run.toml").read_text(encoding="utf-8")
    former = re.sub(r'^model = "\d+"', 'model = "7"', whole, flags=re.M)
    (run / "run.toml").write_text(former, encoding="utf-8")
    said = told("report runs/mine").replace("1-short.nc", "1-stir.nc")
    assert re.sub(r"(model_|this is )\d+", r"\g<1>8", said) in QUOTED
    (run / "run.toml").write_text(whole, encoding="utf-8")
    (run / "posterior.nc").write_bytes(b"cut off")
    assert told("report runs/mine").replace("1-short.nc", "1-stir.nc") in QUOTED
    (run / "posterior.nc").unlink()
    assert told("report runs/mine").replace("1-short.nc", "1-stir.nc") in QUOTED
    (run / "run.toml").unlink()
    assert told("report runs/mine").replace("1-short.nc", "1-stir.nc") in QUOTED
    shutil.rmtree(run / "recordings")
    assert told("report runs/mine") in QUOTED
    assert told("calibrate stir.nc --out runs/mine") in QUOTED


def test_there_are_causes_and_cures():
    page = read_page("troubleshooting")
    assert len(QUOTED) >= 20
    for before, after in zip(QUOTED, [*QUOTED[1:], None], strict=True):
        rest = page.split(before, 1)[1]
        entry = rest if after is None else rest.split(after, 1)[0]
        assert len(re.sub(r"[`#\s]", "", entry)) > 5, before
