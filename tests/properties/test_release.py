"""A release says one version."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]


@pytest.mark.parametrize(
    ("file", "line"), [("CITATION.cff", f"version: {VERSION}"), ("CHANGELOG.md", f"## {VERSION}")]
)
def test_it_is_that_of_pyproject(file, line):
    lines = (ROOT / file).read_text("utf-8").splitlines()
    assert sum(one == line or one.startswith(f"{line} ") for one in lines) == 1
