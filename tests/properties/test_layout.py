"""The house's rules of layout, read from the source without importing it."""

import ast
import re
import tomllib
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
APPLICATION = "bolfi_liquids"
PARTS = ("hardware", "inference", "models")
FOLDERS = (APPLICATION, *PARTS, "tests")
MAX_LONG_ARGUMENT_LISTS = 12
EXEMPTION = re.compile(r"noqa:[^#\n]*\bPLR0913\b")

Graph = dict[str, set[str]]


def module_name(path: Path) -> str:
    """Dotted name under which a file, relative to the root, is imported once installed."""
    names = path.with_suffix("").parts
    if names[0] in PARTS:
        names = (APPLICATION, *names)
    return ".".join(names[:-1] if names[-1] == "__init__" else names)


def sources(root: Path) -> dict[str, Path]:
    """Module's name -> its file, for the application and its parts."""
    paths = (path for top in (APPLICATION, *PARTS) for path in (root / top).rglob("*.py"))
    return {module_name(path.relative_to(root)): path for path in paths}


def imported(module: str, path: Path) -> Iterator[tuple[str, str]]:
    """(module, name in it) of each import, wherever it stands: deferred, for types, in a stub."""
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    stub = path.with_suffix(".pyi")
    texts = [path.read_text(), *([stub.read_text()] if stub.exists() else [])]
    for node in (node for text in texts for node in ast.walk(ast.parse(text))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: 1 - node.level or None] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from ((base, alias.name) for alias in node.names)


def import_graph(root: Path) -> Graph:
    """Module -> modules of this project that it imports."""
    found = sources(root)
    graph: Graph = {module: set() for module in found}
    for module, path in found.items():
        for base, name in imported(module, path):
            target = f"{base}.{name}" if f"{base}.{name}" in found else base
            if target in found and target != module:
                graph[module].add(target)
    return graph


def room_graphs(graph: Graph) -> dict[str, Graph]:
    """Package -> what imports what among its own modules and rooms, each room as a whole."""
    rooms: dict[str, Graph] = {}
    for module, targets in graph.items():
        for target in targets:
            package, start, end = _parting(module, target)
            rooms.setdefault(package, {}).setdefault(start, set()).add(end)
    return rooms


def _parting(module: str, target: str) -> tuple[str, str, str]:
    """Innermost package of two modules, and the names below it under which each is found."""
    one, other = (f"{name}.__init__".split(".") for name in (module, target))
    depth = next(i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b)
    return ".".join(one[:depth]), one[depth], other[depth]


def circle(graph: Graph) -> list[str]:
    """One circle of imports, its first member again at its end; empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as err:
        return err.args[1]
    return []


def files(*suffixes: str) -> list[Path]:
    return [p for top in FOLDERS for p in (ROOT / top).rglob("*") if p.suffix in suffixes]


@pytest.fixture(scope="module")
def imports() -> Graph:
    return import_graph(ROOT)


def test_modules_do_not_import_each_other_in_a_circle(imports):
    found = circle(imports)
    assert not found


def test_rooms_do_not_import_each_other_in_a_circle(imports):
    circles = {package: circle(graph) for package, graph in room_graphs(imports).items()}
    found = {package: rooms for package, rooms in circles.items() if rooms}
    assert not found


@pytest.mark.parametrize("part", PARTS)
def test_a_part_imports_neither_another_part_nor_the_application(imports, part):
    own = f"{APPLICATION}.{part}"
    for module, targets in imports.items():
        if f"{module}.".startswith(f"{own}."):
            foreign = {target for target in targets if not f"{target}.".startswith(f"{own}.")}
            assert not foreign, module


def test_long_argument_lists_stay_rare():
    """But for commands, whose arguments are their options."""
    counted = (path for path in files(".py") if "cli" not in path.parts)
    counts = {path: len(EXEMPTION.findall(path.read_text())) for path in counted}
    exempt = {path: count for path, count in counts.items() if count}
    total = sum(exempt.values())
    assert total <= MAX_LONG_ARGUMENT_LISTS, exempt


def test_every_package_is_installed():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    assert len(listed) == len(set(listed))
    folders = {
        module_name(path.relative_to(ROOT).parent / "__init__.py")
        for path in sources(ROOT).values()
    }
    assert set(listed) == folders


@pytest.mark.parametrize(
    ("upper", "lower"),
    [
        ("from .lower import x", "from .upper import y"),
        ("from bolfi_liquids.lower import x", "from . import upper"),
        ("import bolfi_liquids.lower", "def late():\n    from .upper import y"),
        (
            "from .lower import x",
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .upper import y",
        ),
    ],
    ids=["relative", "absolute", "deferred", "for types"],
)
def test_a_planted_circle_of_modules_is_found(tmp_path, upper, lower):
    _write(tmp_path, {"__init__": "", "upper": upper, "lower": lower})
    assert set(circle(import_graph(tmp_path))) == {"bolfi_liquids.upper", "bolfi_liquids.lower"}


def test_a_planted_circle_of_rooms_is_found(tmp_path):
    planted = {
        "hall/first": "from ..yard.first import x",
        "hall/second": "",
        "yard/first": "",
        "yard/second": "from bolfi_liquids.hall import second",
    }
    _write(tmp_path, planted)
    graph = import_graph(tmp_path)
    assert not circle(graph)
    assert set(circle(room_graphs(graph)[APPLICATION])) == {"hall", "yard"}


def _write(root: Path, modules: dict[str, str]) -> None:
    for name, text in modules.items():
        path = root / APPLICATION / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
