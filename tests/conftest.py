"""Tests in which processes must keep time, on computers that may not; what JAX compiled is kept."""

import json
import os
import shutil
import sys
import tarfile
import time
import tomllib
from pathlib import Path
from threading import Event, Thread

import pytest
import tomli_w
from _pytest.runner import runtestprotocol

APPLICATION = "bolfi_liquids"
POURED = {"pour", "frames"}  # its fixtures that take a minute where nothing is compiled yet
SIMULATED = {"calibration", *POURED}
MAINTAINED = {"benchmarks", "physics"}  # folders of what only maintainers run, with its tests
SIMULATING = ("models", "physics", "simulation")  # folders of tests
CONTROLLED = {"arm", "emulator", "robot"}  # fixtures of tests that talk to an emulated controller
MOST_REPEATS = 3  # of a session; with more of them, tests hide what fails
CALM, MOST_CALM = 1.0, 30.0  # s, without a stall before a repetition; and waited for at most
REPEATED = pytest.StashKey[list[str]]()
STALL = 0.03  # s; a watchdog of 0.1 s and several processes wait for each other


def pytest_configure(config):
    config.addinivalue_line("markers", "alone: runs after the others, with no test beside it")
    config.addinivalue_line(
        "markers",
        "punctual: alone, and repeated once if it failed on a computer that stood still meanwhile",
    )
    config.stash[REPEATED] = []
    # several processes with a thread of BLAS for each processor: it solved twenty times as slowly
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # many processes compile the same functions
    if hasattr(config, "cache"):
        os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(config.cache.mkdir("jax")))
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")


@pytest.hookimpl(tryfirst=True)  # before tests are selected by their markers
def pytest_collection_modifyitems(items):
    """What simulates comes first: of two workers one then compiles the kernels, not both."""
    items.sort(key=lambda item: not _simulates(item))
    for item in items:
        folder = _folders(item)[0]
        if folder in MAINTAINED or (POURED & set(item.fixturenames) and folder == APPLICATION):
            item.add_marker("slow")


def _folders(item):
    return item.path.relative_to(Path(__file__).parent).parts


def _simulates(item):
    folders = _folders(item)
    application = folders[0] == APPLICATION and bool(SIMULATED & set(item.fixturenames))
    return application or any(one in SIMULATING for one in folders)


@pytest.fixture
def importable(monkeypatch):
    """Started processes find the modules of tests, however pytest was started."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1])


@pytest.fixture
def results_folder(tmp_path):
    """Where figures and records go: the directory that RESULTS names, or a temporary one."""
    folder = Path(os.environ.get("RESULTS") or tmp_path)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture
def poured_run(made_poured_run, tmp_path):
    """A run that has chosen a pour, to be altered."""
    return shutil.copytree(made_poured_run, tmp_path / "poured_run")


@pytest.fixture(scope="session")
def made_poured_run(tmp_path_factory):
    """A small run of `tests/data`, as if today's fluid and engine had made it.

    Of the first 60 samples of the bundled glycerin_v10.nc, without its simulations:

        run = bl.calibrate(short, out=..., budget=8, batch=2, particles=200, seed=5, chains=2,
                           draws=100)
        bl.choose_pour(run, budget=24, iterations=7, draws=16)
    """
    from bolfi_liquids.run.results import generations, read_result
    from bolfi_liquids.run.run import RESULTS, RUN_TOML, Run

    folder = tmp_path_factory.mktemp("poured_run")
    with tarfile.open(Path(__file__).parent / "data" / "poured_run.tar.xz") as archive:
        archive.extractall(folder, filter="data")
    path, now = folder / "poured_run", generations()
    record = tomllib.loads((path / RUN_TOML).read_text(encoding="utf-8"))
    record["simulator"]["recording_1"]["model"] = now["model"]
    record["engine"]["version"] = now["engine"]
    (path / RUN_TOML).write_text(tomli_w.dumps(record), encoding="utf-8")
    run = Run.open(path)
    trees = {step: read_result(path / RESULTS[step]) for step in ("calibrate", "pour")}
    summaries = {step: json.loads(tree.attrs["summary"]) for step, tree in trees.items()}
    run.keep("calibrate", trees["calibrate"], run.made_from, summaries["calibrate"])
    made_from = json.loads(trees["pour"].attrs["made_from"]) | {"after": run.posterior_key()}
    run.keep("pour", trees["pour"], made_from, summaries["pour"])
    return path


@pytest.fixture(scope="session")
def with_numbers():
    """Changes numbers of a result, as a step would have written them; the path of the run."""
    from bolfi_liquids.run.run import Run

    def change(run, step="calibrate", /, **numbers):
        opened = Run.open(run)
        tree = opened.required(step)
        summary = json.loads(tree.attrs["summary"]) | numbers
        opened.keep(step, tree, json.loads(tree.attrs["made_from"]), summary)
        return opened.path

    return change


@pytest.fixture(autouse=True)
def _figures_are_closed():
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


def pytest_runtest_protocol(item, nextitem):
    """Repeat a test that failed while the computer stood still; a failure in peace counts."""
    if item.get_closest_marker("punctual") is None and not CONTROLLED & set(item.fixturenames):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    with _Stillness() as stillness:
        reports = runtestprotocol(item, nextitem=nextitem, log=False)
    if any(report.failed for report in reports) and stillness.disturbed():
        item.config.stash[REPEATED].append(item.nodeid)
        _wait_for_calm()
        # a fixture that failed would fail again without a new setup
        item.session._setupstate.teardown_exact(None)
        item._initrequest()
        reports = runtestprotocol(item, nextitem=nextitem, log=False)
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def pytest_terminal_summary(terminalreporter, config):
    repeated = config.stash[REPEATED]
    if repeated:
        terminalreporter.section("repeated, since this computer stood still")
        terminalreporter.write_line("\n".join(repeated))
    terminalreporter.write_line(f"repeats: {len(repeated)}; above {MOST_REPEATS} is a failure")


def pytest_sessionfinish(session, exitstatus):
    if exitstatus == pytest.ExitCode.OK and len(session.config.stash[REPEATED]) > MOST_REPEATS:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


class _Stillness:
    """Whether this computer stood still, or its processors were lent to others, for a while."""

    def __enter__(self):
        self._worst, self._stolen, self._over = 0.0, _stolen(), Event()
        Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._over.set()

    def disturbed(self):
        return max(self._worst, _stolen() - self._stolen) > STALL

    def _watch(self):
        while not self._over.is_set():
            start = time.monotonic()
            time.sleep(0.005)
            self._worst = max(self._worst, time.monotonic() - start - 0.005)


def _wait_for_calm():
    end = time.monotonic() + MOST_CALM
    while time.monotonic() < end:
        with _Stillness() as stillness:
            time.sleep(CALM)
        if not stillness.disturbed():
            return


def _stolen():
    """Time that a virtual machine's processors were not given to it [s]; 0 where not told."""
    try:
        first = Path("/proc/stat").read_text().splitlines()[0].split()
        return int(first[8]) / 100.0
    except (OSError, IndexError, ValueError):
        return 0.0
