"""Faults are planted in source lines, one at a time: how many do the tests catch?

    python tests/benchmarks/planted_faults.py [--count 60] [--seed 0] [--part 0/1]

Run in a clean clone, whose files are changed and restored. The seed picks lines of the engine,
the models and the guards; in each, one comparison, operation, condition, constant or argument is
changed. The tests of the folder that mirrors the file's run first, then those of its parents.
A fault counts as caught when a test fails, or when the tests take longer than `--limit`, as
an endless loop does. Each is printed with its line, so that an equivalent change can be told from
a gap. `--part k/n` takes every n-th fault from the k-th on, for n clones at a time.
"""

import argparse
import ast
import copy
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

PLACES = ("inference", "models", "hardware/safety")
SWAPPED = {
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
QUICK = "not slow and not minutes and not hardware and not benchmark"


class Fault(NamedTuple):
    """One change of a file: bytes `start` to `stop` become `text`."""

    file: Path
    line: int
    start: int
    stop: int
    text: str

    def planted(self, source: bytes) -> bytes:
        return source[: self.start] + self.text.encode() + source[self.stop :]


def changed(node: ast.AST) -> ast.expr | None:
    """The same expression with one fault; None where none is meant for it."""
    other = copy.deepcopy(node)
    match other:
        case ast.Compare(ops=[operator, *_]) if type(operator) in SWAPPED:
            other.ops[0] = SWAPPED[type(operator)]()
        case ast.BinOp(op=operator) | ast.BoolOp(op=operator) if type(operator) in SWAPPED:
            other.op = SWAPPED[type(operator)]()
        case ast.Constant(value=bool(value)):
            other.value = not value
        case ast.Constant(value=int(value) | float(value)):
            other.value = value + 1
        case ast.UnaryOp(op=ast.Not(), operand=operand) | ast.UnaryOp(ast.USub(), operand):
            return operand
        case ast.IfExp(body=body, orelse=orelse):
            other.body, other.orelse = orelse, body
        case ast.Call(args=[first, second, *rest]):
            other.args = [second, first, *rest]
        case _:
            return None
    return other


def expressions(tree: ast.AST) -> Iterator[ast.expr]:
    """Every expression that is computed: no annotation, and nothing within an f-string."""
    for name, value in ast.iter_fields(tree):
        if name in {"annotation", "returns", "type_params"} or isinstance(value, ast.JoinedStr):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.expr):
                yield node
            if isinstance(node, ast.AST) and not isinstance(node, ast.JoinedStr):
                yield from expressions(node)


def faults_of(file: Path) -> Iterator[Fault]:
    """Every fault that may be planted in a file."""
    source = file.read_bytes()
    lines = source.splitlines(keepends=True)
    begins = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
    for node in expressions(ast.parse(source)):
        if (other := changed(node)) is not None:
            yield Fault(
                file,
                node.lineno,
                int(begins[node.lineno - 1]) + node.col_offset,
                int(begins[node.end_lineno - 1]) + node.end_col_offset,
                f"({ast.unparse(other)})",
            )


def drawn(count: int, seed: int) -> list[Fault]:
    """Faults in as many different lines, which the seed picks among all lines that hold one."""
    by_line = defaultdict(list)
    for place in PLACES:
        for file in sorted(Path(place).rglob("*.py")):
            for fault in faults_of(file):
                by_line[file, fault.line].append(fault)
    rng = np.random.default_rng(seed)
    lines = sorted(by_line)
    chosen = rng.choice(len(lines), count, replace=False)
    return [by_line[lines[k]][rng.integers(len(by_line[lines[k]]))] for k in chosen]


def rooms(file: Path) -> list[Path]:
    """Folders of tests that mirror a file's, the nearest first."""
    mirrored = [Path("tests") / parent for parent in file.parents]
    return [folder for folder in mirrored if folder.is_dir() and folder != Path("tests")]


def is_caught(file: Path, limit: float) -> bool:
    """Whether the tests of a changed file fail, or do not end in `limit` seconds."""
    for folder in rooms(file):
        words = ["-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", QUICK, str(folder)]
        try:
            done = subprocess.run(
                [sys.executable, *words], capture_output=True, timeout=limit, check=False
            )
        except subprocess.TimeoutExpired:
            return True
        if done.returncode not in (0, 5):  # 5: the folder holds no quick tests
            return True
    return False


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--part", default="0/1")
    parser.add_argument("--limit", type=float, default=900.0, help="s a folder's tests may take")
    given = parser.parse_args()
    first, parts = map(int, given.part.split("/"))
    if subprocess.check_output(["git", "status", "--porcelain", *PLACES]):
        raise SystemExit("planted_faults: commit first; the sources are changed and restored")
    caught = 0
    chosen = drawn(given.count, given.seed)[first::parts]
    for fault in chosen:
        source = fault.file.read_bytes()
        try:
            fault.file.write_bytes(fault.planted(source))
            found = is_caught(fault.file, given.limit)
        finally:
            fault.file.write_bytes(source)
        caught += found
        before = " ".join(source[fault.start : fault.stop].decode().split())
        verdict = "caught" if found else "MISSED"
        print(f"{verdict} {fault.file}:{fault.line}: {before} -> {fault.text}", flush=True)
    print(f"{caught} of {len(chosen)} caught")
    return 0


if __name__ == "__main__":
    sys.exit(main())
