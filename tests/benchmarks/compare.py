"""Our engine and its peers on the same tasks, data, budgets and seeds, in one go.

    .venv/bin/python tests/benchmarks/compare.py --tasks gauss2 --budgets 20 50 --seeds 0 1 2

Each run has a process of its own, bound to one processor. Results are kept as JSON lines: an
interrupted comparison goes on where it stopped, and one whose code has changed repeats what the
change may have touched. `make peers` builds the peers' environments.
"""

import argparse
import json
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

import numpy as np
from engines import ENGINES, OURS, ROOT, command, digest
from peers.job import Job, reference_path, results
from report import report, write_page
from tasks import TASKS, make_reference


def main() -> None:
    chosen = arguments()
    if chosen.page:
        rows = current(chosen)
        if not rows:
            sys.exit(f"{results(chosen.out)} has no results of today's code: run it without --page")
        write_page(rows, chosen.page)
        return
    missing = [name for name in chosen.engines if not ENGINES[name].python.exists()]
    if missing:
        sys.exit(f"no environment for {', '.join(missing)}: run `make peers`, or name --engines")
    chosen.out.mkdir(parents=True, exist_ok=True)
    jobs = plan(chosen)
    print(f"{len(jobs)} processes to run; results go to {results(chosen.out)}", flush=True)
    failed = run_all(jobs, chosen.cores)
    print(report(current(chosen)))
    if failed:
        sys.exit(f"{failed} processes failed, see above; the same command tries them again")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--tasks", nargs="+", choices=TASKS, default=list(TASKS))
    add("--engines", nargs="+", choices=ENGINES, default=[e for e in ENGINES if e != "npe_pfn"])
    add("--budgets", nargs="+", type=int, default=[10, 20, 40, 60, 100, 200])
    add("--seeds", nargs="+", type=int, default=list(range(20)))
    add("--data", default="each", help="seed of the data, or `each`: every run's own seed")
    add(
        "--timed-seeds",
        type=int,
        default=1,
        help="how many of the seeds also show our warm runs, single steps, and NUTS",
    )
    add("--cores", nargs="+", type=int, default=[0], help="processors that work at once")
    add("--out", type=Path, default=ROOT / "runs" / "compare")
    add(
        "--page",
        type=Path,
        help="run nothing; write the report of what there is, with figure and scores beside it",
    )
    chosen = parser.parse_args()
    if chosen.data != "each" and not chosen.data.isdigit():
        parser.error(f"--data must be a seed or `each`, got {chosen.data!r}")
    chosen.budgets, chosen.out = sorted(set(chosen.budgets)), chosen.out.resolve()
    return chosen


def data_seed(chosen: argparse.Namespace, seed: int) -> int:
    return seed if chosen.data == "each" else int(chosen.data)


def plan(chosen: argparse.Namespace) -> list[Job]:
    """What the results lack; engines side by side, so that they meet the same machine."""
    rows = current(chosen)
    done = {(r["engine"], r["kind"], r["task"], r["seed"], r["n"]) for r in rows}
    jobs = []
    for task in chosen.tasks:
        for i, seed in enumerate(chosen.seeds):
            data, timed = data_seed(chosen, seed), i < chosen.timed_seeds
            prepare(chosen.out, task, data)
            for engine in filter(lambda name: ENGINES[name].takes(TASKS[task]), chosen.engines):
                for kind, budgets in processes(chosen.budgets, engine in OURS and timed):
                    left = tuple(n for n in budgets if (engine, kind, task, seed, n) not in done)
                    job = Job(
                        engine=engine,
                        kind=kind,
                        task=task,
                        seed=seed,
                        budgets=left,
                        data=data,
                        timed=timed,
                        code=digest(engine),
                        out=str(chosen.out),
                        core=0,
                    )
                    jobs += [job] if left else []
    return jobs


def processes(budgets: list[int], apart: bool) -> list[tuple[str, list[int]]]:
    """Kinds and budgets of the processes for one engine and seed.

    `apart`: every budget in a cold process, and one that measures single steps.
    """
    if not apart:
        return [("posterior", budgets)]
    return [*(("posterior", [n]) for n in budgets), ("steps", sorted({budgets[0], budgets[-1]}))]


def prepare(out: Path, task: str, data: int) -> None:
    """Store the data and the exact posterior, which every engine reads; once for today's tasks."""
    path = reference_path(out, task, data)
    if path.exists() and str(np.load(path)["code"]) == digest(None):
        return
    observed = TASKS[task].observe(data)
    reference = make_reference(TASKS[task], observed)
    np.savez(path, observed=observed, code=digest(None), **reference._asdict())


def run_all(jobs: list[Job], cores: list[int]) -> int:
    """Number of jobs that failed."""
    free: SimpleQueue[int] = SimpleQueue()
    for core in cores:
        free.put(core)

    def run(job: Job) -> bool:
        core = free.get()
        try:
            return run_one(job._replace(core=core))
        finally:
            free.put(core)

    with ThreadPoolExecutor(len(cores)) as pool:
        return len(jobs) - sum(pool.map(run, jobs))


def run_one(job: Job) -> bool:
    """Whether the job's process ended well; says so."""
    arguments, environment = command(job.engine, json.dumps(job._asdict()))
    started = time.perf_counter()
    done = subprocess.run(  # where sbi leaves logs, nobody minds
        arguments, cwd=job.out, env=environment, capture_output=True, text=True, check=False
    )
    name = f"{job.task} {job.engine} {job.kind} seed {job.seed} N {job.budgets}"
    if done.returncode:
        print(f"{name} failed:\n{done.stderr[-2000:]}", flush=True)
    else:
        print(f"{name}: {time.perf_counter() - started:.0f} s", flush=True)
    return done.returncode == 0


def current(chosen: argparse.Namespace) -> list[dict]:
    """Rows of the chosen tasks, engines, budgets, seeds and data that today's code would make."""
    file = results(chosen.out)
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    return [
        row
        for row in rows
        if row["task"] in chosen.tasks
        and row["engine"] in chosen.engines
        and row["n"] in chosen.budgets
        and row["seed"] in chosen.seeds
        and row["data"] == data_seed(chosen, row["seed"])
        and row["code"] == digest(row["engine"])
    ]


if __name__ == "__main__":
    main()
