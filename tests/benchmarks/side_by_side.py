"""CPU and wall seconds of a command in this tree and in that of another commit, run in turns.

    side_by_side.py COMMIT NAME... [--into DIR] [--turns N] [-- ARGUMENTS OF first_result.py]

The other commit becomes a git worktree with its own environment under DIR, and is used again if it
is there. JAX's compilations are kept for each tree; all but `first`, `tests` and `nothing` run once
before. `nothing` is `make demo` in a fresh clone of the commit, without a cache.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
DATA = "bolfi_liquids/data/{}_oil_v{}.nc"
FIRST = f"{{bin}}/python -P {HERE / 'first_result.py'}"
CALL = "{{bin}}/python -c 'import numpy as np, bolfi_liquids as bl; bl.{}'"
COMMANDS = {  # {bin} of the tree's environment, {out} an empty directory, {kept} one that stays
    "first": f"{FIRST} own {{arguments}}",
    "second": f"{FIRST} own --cache {{kept}}/jax {{arguments}}",
    "engine": f"{FIRST} own --cache {{kept}}/jax --parameters 4 {{arguments}}",
    "stirs": CALL.format("simulate_stir(np.geomspace(0.01, 1, 16))"),
    "pours": CALL.format("simulate_pour(np.geomspace(0.01, 1, 16))"),
    "demo": "{bin}/bolfi-liquids demo --out {out}/run",
    "criticise": "test -d {kept}/run || ({bin}/bolfi-liquids calibrate --out {out}/made"
    f" {DATA.format('late', 10)} && mv {{out}}/made {{kept}}/run)"
    " && cp -r {kept}/run {out}/run && {bin}/bolfi-liquids"
    f" criticise {{out}}/run --held-out {DATA.format('late', 7)}"
    f" --baseline {DATA.format('clean', 10)}",
    "nothing": "git clone -q . {out}/clone && cd {out}/clone"
    " && env -u JAX_COMPILATION_CACHE_DIR -u XDG_CACHE_HOME HOME={out} make demo",
    "tests": "make test",
}
COLD = "first", "nothing", "tests"


def tree_of(commit: str, into: Path) -> Path:
    """A worktree of the commit with its environment, made if it is missing."""
    tree = into / commit
    if not (tree / ".venv/.installed").exists():
        subprocess.run(["git", "worktree", "prune"], cwd=ROOT, check=True)
        add = ["git", "worktree", "add", "--force", "--detach", str(tree), commit]
        subprocess.run(add, cwd=ROOT, check=True)
        subprocess.run(["make", "setup"], cwd=tree, check=True)
    return tree


def spent(name: str, tree: Path, kept: Path, arguments: str) -> tuple[float, float]:
    """CPU and wall seconds of one run."""
    with tempfile.TemporaryDirectory() as out:
        where = {"bin": tree / ".venv/bin", "out": out, "kept": kept, "arguments": arguments}
        environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": str(kept / "jax")}
        before, began = getrusage(RUSAGE_CHILDREN), time.perf_counter()
        line = COMMANDS[name].format_map(where)
        done = subprocess.run(line, shell=True, cwd=tree, env=environment, capture_output=True)
        wall, after = time.perf_counter() - began, getrusage(RUSAGE_CHILDREN)
    if done.returncode:
        sys.exit(f"{tree}: {line}\n{(done.stderr or done.stdout).decode()[-2000:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("names", nargs="+", choices=COMMANDS, metavar="NAME", help=str([*COMMANDS]))
    parser.add_argument("--into", type=Path)
    parser.add_argument("--turns", type=int, default=3)
    typed, _, arguments = " ".join(sys.argv[1:]).partition(" -- ")
    given = parser.parse_args(typed.split())
    into = (given.into or Path(tempfile.mkdtemp(prefix="side_by_side_"))).resolve()
    trees = {given.commit: tree_of(given.commit, into), "here": ROOT}
    kept = {name: into / f"kept_{name}" for name in trees}
    for directory in kept.values():
        (directory / "jax").mkdir(parents=True, exist_ok=True)
    print(
        f"{'':10}"
        + "".join(f"{f'{at} {unit}':>20}" for unit in ("CPU s", "wall s") for at in trees)
    )
    for name in given.names:
        runs = {at: [] for at in trees}
        for turn in range(-(name not in COLD), given.turns):
            for at, tree in trees.items():
                found = spent(name, tree, kept[at], arguments)
                runs[at] += [found] if turn >= 0 else []
        then, now = (np.median(runs[at], axis=0) for at in trees)
        figures = "".join(f"{one:20.2f}" for pair in zip(then, now, strict=True) for one in pair)
        print(f"{name:10}{figures}   ratios {' '.join(f'{r:.2f}' for r in now / then)}", flush=True)
    if given.into is None:
        subprocess.run(["git", "worktree", "remove", "--force", str(into / given.commit)], cwd=ROOT)
        shutil.rmtree(into)


if __name__ == "__main__":
    main()
