"""The guide says what the software does: files, commands, options and messages."""

import json
import re
import sys
import tomllib
from importlib.resources import files
from itertools import product
from pathlib import Path

import pytest
import xarray
from typer.main import get_command
from typer.testing import CliRunner

from bolfi_liquids.cli.app import app
from bolfi_liquids.guide import PAGES, read_page, title

LINE = re.compile(r"^- `(?P<name>[^`]+)`(?: \((?P<dims>[^)]*)\))?(?: \[(?P<unit>[^\]]+)\])?:")
BRACES = re.compile(r"\{([^{}]*)\}")
ARVIZ = (
    "created_at",
    "creation_library",
    "creation_library_version",
    "creation_library_language",
    "sample_dims",
)
COMMAND = re.compile(r"`?bolfi-liquids((?: [a-z][a-z-]*)+)")


def expanded(text):
    """`{a,b}/x` as `a/x` and `b/x`."""
    parts = [one.split(",") if at % 2 else [one] for at, one in enumerate(BRACES.split(text))]
    return ["".join(choice) for choice in product(*parts)]


def told(heading):
    """What a section of files.md lists: name -> (dimensions, unit)."""
    page = read_page("files")
    section = re.split(r"^#+ ", page.split(f"# {heading}\n", 1)[1], maxsplit=1, flags=re.M)[0]
    found = {}
    for line in section.splitlines():
        if match := LINE.match(line):
            dims = tuple(match["dims"].split(", ")) if match["dims"] else ()
            found |= {name: (dims, match["unit"]) for name in expanded(match["name"])}
    return found


def held(path):
    """What a NetCDF file holds, in the same form."""
    found = {}
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        for group in tree.subtree:
            dataset, at = group.to_dataset(inherit=False), group.path.strip("/")
            prefix = f"{at}/" if at else ""
            found |= {f"{at}@{name}": ((), None) for name in dataset.attrs if name not in ARVIZ}
            for name, variable in dataset.variables.items():
                unit = variable.attrs.get("units")
                found[f"{prefix}{name}"] = (variable.dims, unit)
                attributes = set(variable.attrs) - {"units"}
                found |= {f"{prefix}{name}@{key}": ((), None) for key in attributes}
    return found


@pytest.mark.parametrize("name", ["posterior.nc", "pour.nc"])
def test_files_are_told_variable_by_variable(calibration, pour, name):
    in_file, in_page = held(pour.path / name), told(name)
    assert set(in_page) == set(in_file)
    plain = {"rad s-1": "rad/s"}
    for what, (dims, unit) in in_file.items():
        if dims and what.rpartition("/")[2] != dims[0]:  # a coordinate is its own dimension
            assert in_page[what][0] == dims, what
        if unit is not None:
            assert in_page[what][1] == plain.get(unit, unit), what


def fields(value, path=""):
    """`a.b` for each number or text of nested tables."""
    if not isinstance(value, dict):
        return {path}
    return {one for key, of in value.items() for one in fields(of, f"{path}.{key}".strip("."))}


@pytest.mark.parametrize("section", ["calibrate", "pour"])
def test_summary_is_told_field_by_field(calibration, pour, section):
    summary = json.loads((pour.path / "summary.json").read_text(encoding="utf-8"))[section]
    named = re.compile(r"\.(viscosity|cohesion)(?=\.|$)")
    told_here = {
        name
        for line in told_lines(section)
        for quoted in re.findall(r"`([^`]+)`", line.split("]:")[0].split("`: ")[0] + "`")
        for name in expanded(quoted)
    }
    # what is null as a whole has no fields
    empty = {name for name, value in summary.items() if value is None}
    told_here = {name.split(".")[0] if name.split(".")[0] in empty else name for name in told_here}
    assert {named.sub(".NAME", name) for name in fields(summary)} == told_here


def told_lines(heading):
    page = read_page("files").split("\n## summary.json\n", 1)[1].split(f"### {heading}\n", 1)[1]
    section = re.split(r"^#+ ", page, maxsplit=1, flags=re.M)[0]
    return [line for line in section.splitlines() if line.startswith("- ")]


def test_criticise_is_told_field_by_field(criticism_summary):
    lines = " ".join(told_lines("criticise"))
    for name in criticism_summary.to_json():
        assert re.search(rf"`{name}[`.]", lines), name


def test_run_directory_and_run_toml_are_told(calibration, pour):
    page = read_page("files")
    listed = page.split("\n## A run\n", 1)[1].split("\n### posterior.nc\n", 1)[0]
    for path in calibration.path.iterdir():
        assert f"`{path.name}" in listed, path.name
    record = tomllib.loads((calibration.path / "run.toml").read_text(encoding="utf-8"))
    for name, value in record.items():
        assert f"`{name}" in listed, name
        for key in value if isinstance(value, dict) else ():
            if name != "versions":
                assert f"`{key}`" in listed or f"{name}.{key}`" in listed, key


def test_fields_of_rig_and_cups_are_those_of_their_types():
    sys.path.append(str(Path(__file__).parent))
    from field_lists import lists, section

    page = read_page("files")
    for name, fields in lists(page).items():
        assert fields in section(page, name), "run tests/bolfi_liquids/guide/field_lists.py"
        assert ":  (" not in fields  # each has its meaning


def test_columns_of_a_session_are_told():
    from bolfi_liquids.hardware.recorder.samples import Sample
    from bolfi_liquids.hardware.vision.frame import Flag, FrameMeasurement

    page = read_page("files")
    arm, pictures = page.split("\n`samples.csv`:\n", 1)[1].split("\n`frames_xz.csv` and", 1)
    for name in Sample._fields:
        assert f"`{name}`" in arm, name
    for name in FrameMeasurement._fields:
        assert f"`{name}`" in pictures, name
    for flag in Flag:
        assert f"{flag.value} {str(flag.name).lower().replace('_', ' ')}" in " ".join(
            pictures.split()
        )


def test_attributes_of_a_recording_are_told(dataset):
    listed = told("A recording")
    for name in dataset.variables:
        assert listed[name] == (dataset[name].dims, dataset[name].attrs["units"])
    for name in dataset.attrs:
        assert f"@{name}" in listed or name == "stick_density"


def test_pages_are_installed_and_printed():
    for page in PAGES:
        assert (files("bolfi_liquids.guide") / f"{page}.md").is_file()
        result = CliRunner().invoke(app, ["guide", page], env={"COLUMNS": "80"})
        assert result.exit_code == 0
        assert title(page) in result.stdout
        assert max(map(len, result.stdout.splitlines())) <= 80, page


def test_readme_and_site_list_the_pages():
    root = Path(__file__).parents[3]
    readme, site = ((root / at).read_text("utf-8") for at in ("README.md", "docs/index.md"))
    rows = re.findall(r"^\| \[(\w+)\]\(bolfi_liquids/guide/\1\.md\) \| (.*) \|$", readme, re.M)
    assert rows == [(page, title(page)) for page in PAGES]
    assert re.findall(r"^\.\./bolfi_liquids/guide/(\w+)$", site, re.M) == list(PAGES)


def test_no_field_of_a_table_is_cut():
    result = CliRunner().invoke(app, ["guide", "files"], env={"COLUMNS": "80"})
    assert "…" not in result.stdout


def test_without_a_name_the_pages_are_listed():
    result = CliRunner().invoke(app, ["guide"])
    assert result.exit_code == 0
    *lines, last = result.stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(PAGES)
    assert "bolfi-liquids guide PAGE" in last


def commands():
    """Every command by its words, with the options that it takes."""

    def walk(command, words):
        options = {name for one in command.params for name in one.opts if name.startswith("--")}
        yield words, options | {"--help"}
        for name, child in getattr(command, "commands", {}).items():
            yield from walk(child, (*words, name))

    return dict(walk(get_command(app), ()))


def text_of_pages():
    return "\n".join(read_page(page) for page in PAGES)


def test_every_command_in_the_pages_exists():
    known = commands()
    for match in COMMAND.finditer(text_of_pages()):
        words = tuple(match[1].split())
        taken = [words[:n] for n in range(len(words), 0, -1) if words[:n] in known]
        assert taken, match[0]
        (line,) = re.match(r"[^`\n]*", text_of_pages()[match.end() :]).group(0).splitlines() or [""]
        for option in re.findall(r"--[a-z][a-z-]*", line.partition(" or: ")[0]):
            assert option in known[taken[0]] | known[()], (match[0], option)


def test_every_option_in_the_pages_exists():
    known = set().union(*commands().values())
    foreign = {"--no-deps"}  # of other programs
    prose = re.sub(r"^#+ .*$|^```.*?^```$", "", text_of_pages(), flags=re.M | re.S)
    for option in set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", prose)) - foreign:
        assert option in known, option


def test_every_command_shows_how_it_is_typed():
    groups = {("check",), ("rig",), ("simulate",), ()}  # list their commands
    for words in commands():
        result = CliRunner().invoke(app, [*words, "--help"], env={"COLUMNS": "80"})
        assert result.exit_code == 0
        shown = result.stdout.rpartition("For example:")[2]
        assert words in groups or f"bolfi-liquids {' '.join(words)}" in shown, words
