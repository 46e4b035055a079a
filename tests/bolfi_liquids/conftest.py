import fcntl
import os
import shutil
from contextlib import contextmanager
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.criticism.verdict_kind import VerdictKind
from bolfi_liquids.inference.simulations import Compute

import bolfi_liquids as bl
from bolfi_liquids.calibration.summary import ParameterSummary
from bolfi_liquids.criticism.summary import (
    CameraNoise,
    CriticismSummary,
    DifferingWindow,
    GapSummary,
    SourceVerdict,
)
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.reporting.films import films_of
from bolfi_liquids.run.run import Run, as_json

BUNDLED = Path(str(files("bolfi_liquids.data"))) / "glycerin_v10.nc"
SHORT = 60  # samples, 2 s: the pause and the first strokes
SETTINGS = {"budget": 8, "batch": 2, "particles": 200, "seed": 5}


@pytest.fixture
def dataset():
    """The bundled recording, to be altered."""
    return xr.load_dataset(BUNDLED, decode_times=False)


@pytest.fixture(scope="session")
def short_recording(tmp_path_factory):
    """The path of a recording that simulates in a fraction of a second."""
    path = tmp_path_factory.mktemp("recordings") / "short.nc"
    whole = xr.load_dataset(BUNDLED, decode_times=False)
    whole.isel(time=slice(0, SHORT)).to_netcdf(path)
    return path


@pytest.fixture(scope="session")
def settings():
    """Of `calibration`, under the names of the command line's options."""
    return SETTINGS


@pytest.fixture(scope="session")
def calibration(short_recording, tmp_path_factory):
    """A real calibration, as small as the engine allows it to be useful."""

    def calibrate(run):
        bl.calibrate(short_recording, out=run, progress=False, **SETTINGS)

    return bl.Calibration.open(made_once(tmp_path_factory, "calibrated", calibrate))


def made_once(tmp_path_factory, name, make):
    """A copy of a run that the first worker of a session makes, for tests change theirs."""
    own, base = tmp_path_factory.mktemp("runs") / name, tmp_path_factory.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / name
    whole = shared.with_suffix(".whole")
    with alone_with(shared.with_suffix(".lock")):
        if not whole.exists():
            shutil.rmtree(shared, ignore_errors=True)  # of a worker that was killed in the middle
            make(shared)
            whole.touch()
        shutil.copytree(shared, own)
    return own


@contextmanager
def alone_with(path):
    """Only one process at a time; the lock ends with its process."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="session")
def pour_settings():
    """Of `pour`: less liquid than the bundled cups hold, turned faster: a third of their time."""
    bundled = bundled_cups()
    source = bundled.source.model_copy(update={"fill": 0.02})
    turned = {"angular_velocity_deg_s": (90.0, 180.0), "hold": 0.4}
    plan = bundled.pour.model_copy(update=turned)
    cups = bundled.model_copy(update={"source": source, "pour": plan})
    return {"budget": 24, "draws": 16, "cups": cups}


@pytest.fixture(scope="session")
def pour(calibration, pour_settings, tmp_path_factory):
    """A real pour, chosen over the calibration, in a run of its own."""

    def choose(run):
        shutil.copytree(calibration.path, run)
        bl.choose_pour(run, progress=False, **pour_settings)

    return bl.Pour.open(made_once(tmp_path_factory, "poured", choose))


@pytest.fixture(scope="session")
def films(pour):
    """Moving pictures of the pour's run, which was not criticised."""
    return films_of(bl.Calibration.open(pour.path), pour, Compute(), progress=False)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


EFFECTS = ("camera_delay", "gripper_scale", "stick_mass")
FILES = ("1-first.nc", "2-second.nc")


def spread(q50):
    """Of a parameter whose posterior is about this median."""
    return ParameterSummary(mean=q50, sd=0.1 * q50, q05=0.8 * q50, q50=q50, q95=1.2 * q50)


@pytest.fixture
def criticism_summary():
    """Of a criticism that names and accepts one effect."""
    nowhere = {"channel": None, "start_s": None, "stop_s": None, "stroke": None}
    stroke = {"channel": "xz", "start_s": 1.0, "stop_s": 2.0, "stroke": 1}
    shares = {"none": 0.01, "camera_delay": 0.97, "none of these": 0.02}
    verdict = SourceVerdict(
        VerdictKind.EFFECT, ("camera_delay",), {}, 0.002, 0.97, shares, {}, (), 1
    )
    alone = ("probabilities", "limits")  # of a source
    common = {key: of for key, of in vars(verdict).items() if key not in alone}
    return CriticismSummary(
        **common,
        accepted=("camera_delay",),
        requested=(),
        unsupported=(),
        reason="",
        where=(
            DifferingWindow(**stroke, recording=FILES[0], rms_deg=2.5, p_value=0.01),
            DifferingWindow(
                **nowhere, recording=FILES[1], speed="0 to 3 cm/s", rms_deg=1.5, p_value=0.02
            ),
        ),
        coefficient={"camera_delay": spread(0.05)},
        parameters={"viscosity": spread(0.1), "camera_delay": spread(0.05)},
        best={"viscosity": 0.1, "camera_delay": 0.05},
        n_simulations=77,
        gap=GapSummary(
            before=1.25,
            after=0.31,
            held_out_before=1.5,
            held_out_after=0.42,
            noise=0.33,
            usual=0.2,
            rms_before=1.29,
            rms_after=0.45,
            held_out_rms_before=1.55,
            held_out_rms_after=0.58,
            held_out_noise=0.4,
            held_out_usual=0.25,
        ),
        stirs=verdict,
        pours=None,
        suggestions=(),
        untested=(),
        baseline=2,
        baseline_left_out=(),
        noise=CameraNoise(sd_deg=0.2, sd_uncertainty=0.4, correlation=0.25, samples=32),
        seconds=8.0,
        made_from={"settings": {"effects": None}},
        frame_faults=(),
    )


def _windows(after):
    strokes = [
        (plane, name, number, float(number), number + 1.0, "")
        for name in FILES
        for number in (0, 1)
        for plane in ("xz", "yz")
    ]
    speeds = [("", name, -1, np.nan, np.nan, "0 to 3 cm/s") for name in FILES]
    rows = strokes + speeds
    keys = ("channel", "recording", "stroke", "start_s", "stop_s", "speed")
    columns = {
        key: ("window", list(values))
        for key, values in zip(keys, zip(*rows, strict=True), strict=True)
    }
    for when in ("before", "after") if after else ("before",):
        size = np.full(len(rows), 0.02)
        p_value = np.where(np.arange(len(rows)) == 2, 0.01, 0.5)  # stroke 1 of the first, in xz
        columns |= {f"{key}_{when}": ("window", size) for key in ("rms", "z")}
        columns[f"p_value_{when}"] = ("window", p_value)
    return xr.Dataset(columns)


def _effects(status):
    cosine = np.array([[1.0, 0.2, -0.9], [0.2, 1.0, 0.1], [-0.9, 0.1, 1.0]])
    fitted = status[0] != "not needed"
    columns = {
        "typical": [0.07, 1.07, 1.1],
        "snr": [14.0, 3.5, 0.4],
        "score": [11.0, -4.0, 1.0],
        "side": [0.0, 0.0, 1.0],
        "smallest": [0.01, 0.02, np.nan],
        "limit": [0.02, 0.03, 1.4],
        "gain": [286.0, -20.0, 4.0] if fitted else [np.nan] * 3,
        "p_value": [0.8, 0.003, 0.002] if fitted else [np.nan] * 3,
        "coefficient": [0.05, 0.8, 1.4],
        "status": status,
    }
    names = list(EFFECTS)
    found = xr.Dataset({k: ("effect", v) for k, v in columns.items()}, coords={"effect": names})
    coords = {"effect": names, "other": names}
    return found, xr.Dataset({"cosine": (("effect", "other"), cosine)}, coords=coords)


def _held_out(holds):
    at = ("explanation", "recording")
    sizes = {"before": 0.03, "after": 0.01, "noise": 0.008, "floor": 0.012}
    sizes |= {"p_value": 0.4, "lpd_gain": 33.3}
    columns = {key: (at, [[value]]) for key, value in sizes.items()}
    return xr.Dataset(
        {**columns, "holds": ("explanation", [holds])},
        coords={"explanation": ["camera_delay"], "recording": ["third.nc"]},
    )


MADE_FROM = {
    "version": bl.__version__,
    "settings": {"effects": ["camera_delay", "camera_tilt"], "seed": 3},
    "held_out": {},
    "baseline": {"abc123": "clean.nc"},
    "pours": {},
    "held_out_pours": {},
}


@pytest.fixture
def made_from():
    """What a tree of `made` says that it was made from."""
    return MADE_FROM


STATUS = ("named", "rejected: the data still differ", "rejected: explains nothing")


def _made(*, after=True, held=None, pours=False, status=STATUS):
    """A tree as `criticise` writes it: two recordings of 2 s, and maybe four pours."""
    rng = np.random.default_rng(0)
    frames, each = ("frame", "plane"), 20
    coords = {
        "time": ("frame", np.tile(np.linspace(0.0, 2.0, each), 2)),
        "recording": ("frame", np.repeat([0, 1], each)),
        "plane": ["xz", "yz"],
    }
    names = ["observed"]
    for when in ("before", "after") if after else ("before",):
        names += [f"expected_{when}", f"sd_{when}"]
    angles = {name: (frames, rng.uniform(0.0, 0.05, (2 * each, 2))) for name in names}
    found, confusion = _effects(list(status))
    draws = rng.normal(0.05, 0.005, (2, 100))
    parameters = {"viscosity": 2.0 * draws, "cohesion": 10.0 * draws, "camera_delay": draws}
    sampled = {"rhat_max": 1.002, "ess_bulk_min": 900.0, "ess_tail_min": 800.0, "divergences": 1}
    groups = {
        "/posterior": xr.Dataset(
            {name: (("chain", "draw"), values) for name, values in parameters.items()},
            attrs=sampled,
        ),
        "/stirs/residual": xr.Dataset(angles, coords=coords),
        "/stirs/where": _windows(after),
        "/stirs/effects": found,
        "/stirs/confusion": confusion,
    }
    if held is not None:
        groups["/stirs/held_out"] = _held_out(held)
    if pours:
        pour = {
            "angular_velocity": ("pour", np.linspace(0.5, 2.0, 4)),
            "distance": ("pour", np.full(4, 0.03)),
            "outcome": ["spilled", "retained"],
        }
        fractions = {name: (("outcome", "pour"), rng.uniform(0.0, 0.3, (2, 4))) for name in names}
        groups["/pours/residual"] = xr.Dataset(fractions, coords=pour)
        groups["/pours/effects"], groups["/pours/confusion"] = found, confusion
    tree = xr.DataTree.from_dict(groups)
    tree.attrs.update(
        made_from=as_json(MADE_FROM),
        accepted=["camera_delay"],
        requested=[],
    )
    return tree


@pytest.fixture
def made():
    """Makes a tree as `criticise` writes it, see `_made`."""
    return _made


@pytest.fixture
def keep_criticism(made, made_from, criticism_summary):
    """Keeps a criticism in a calibrated run, with other numbers where they are given."""

    def keep(path, **numbers):
        run, tree = Run.open(path), made(held=True)
        source = made_from | {"after": run.posterior_key()}
        summary = replace(criticism_summary, made_from=source, **numbers)
        run.keep("criticise", tree, source, summary.to_json())
        return run.path

    return keep
