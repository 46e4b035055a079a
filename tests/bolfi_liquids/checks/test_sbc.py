"""The check of whole calibrations: resumable, and each run of the shared set told once."""

import sqlite3
from contextlib import closing
from types import SimpleNamespace
from typing import ClassVar

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr
from bolfi_liquids.inference.acquisition import rules
from bolfi_liquids.inference.criticism import KnownNoise

from bolfi_liquids import inference
from bolfi_liquids.checks.sbc import check_sbc
from bolfi_liquids.checks.sbc_pipelines import (
    FromBank,
    Observed,
    _nearest,
)
from bolfi_liquids.inputs.settings import RUNS_PER_POINT, CalibrationSettings, SbcSettings

SMALL = {"design": 8, "budget": 8, "particles": 200, "seed": 3}


def rows(path, table):
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]


def test_each_run_is_given_once_and_the_nearest_first():
    points = np.array([[0.1, 0.1], [0.2, 0.1], [0.9, 0.9]])
    left = np.ones((3, RUNS_PER_POINT), bool)
    asked = np.array([[0.1, 0.1]] * 5)
    given = list(_nearest(asked, points, left))
    assert given == [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0)]
    assert left.sum() == 1


def test_a_set_that_is_used_up_is_said():
    with pytest.raises(RuntimeError, match="every run of the shared set was told"):
        list(_nearest(np.zeros((2, 1)), np.zeros((1, 1)), np.array([[True]])))
    with pytest.raises(ValueError, match="^design: 20 simulations each, but 2 of 8 points"):
        SbcSettings(design=8, budget=20)
    SbcSettings(design=8, budget=20, runs=0)  # where none is shared


class Watching(rules.PosteriorDraws):
    """Keeps the keys that it was called with."""

    keys: ClassVar[list[tuple[int, ...]]] = []

    def __call__(self, key, *given):
        self.keys.append(tuple(jax.random.key_data(key).tolist()))
        return super().__call__(key, *given)


@pytest.mark.slow
def test_every_batch_is_asked_with_random_numbers_of_its_own(monkeypatch):
    """As by `calibrate`; the same ones again would choose by the same rule again and again."""
    monkeypatch.setitem(rules.RULES, "draws", Watching)
    prior = inference.Prior({"slope": dist.Uniform(0.0, 1.0)})
    theta = (np.arange(20)[:, None] + 0.5) / 20
    clean = theta * np.linspace(0.0, 1.0, 12)
    noise = np.random.default_rng(0).normal(0.0, 0.02, (20, RUNS_PER_POINT, 12, 1))
    stirring = SimpleNamespace(discrepancy=lambda: None)
    settings = CalibrationSettings(budget=20, surrogate="signal")
    signals = clean[:, None, :, None] + noise
    pipeline = FromBank(stirring, prior, theta, signals, settings)
    pipeline(clean[7][:, None], seed=1)
    assert len(Watching.keys) == len(set(Watching.keys)) == 3  # after the start design of eight


def test_camera_noise_is_as_large_as_it_says():
    rng = np.random.default_rng(0)
    noise = Observed(KnownNoise(0.3))(np.zeros((400, 2)), rng)
    # the standard error of a standard deviation is sd / sqrt(2 n)
    assert noise.std() == pytest.approx(0.3, abs=4 * 0.3 / np.sqrt(2 * noise.size))


@pytest.mark.slow
def test_a_check_goes_on_where_it_ended(tmp_path, short_recording):
    out = tmp_path / "sbc"
    few = SbcSettings(runs=3, sequential=1, **SMALL)
    found = check_sbc(out, short_recording, settings=few, progress=False)
    assert {name: len(one.replicates) for name, one in found.items()} == {
        "signal": 3,
        "discrepancy": 1,
    }
    assert rows(out / "simulations.sqlite", "simulation") == RUNS_PER_POINT * SMALL["design"]

    more = SbcSettings(runs=5, sequential=1, **SMALL)
    again = check_sbc(out, short_recording, settings=more, progress=False)
    first = [one.replicates.finished[0].draws for one in (found["signal"], again["signal"])]
    np.testing.assert_array_equal(*first)
    assert rows(out / "simulations.sqlite", "simulation") == RUNS_PER_POINT * SMALL["design"]
    with xr.open_datatree(out / "sbc.nc", engine="h5netcdf") as tree:
        assert tree["signal/replicates"].sizes["replicate"] == 5
        assert tree["signal/regions"]["rate"].dims == ("region", "quantity")
    for name in ("signal", "discrepancy"):
        assert (out / f"{name}.png").is_file() and (out / f"{name}.svg").is_file()

    other = SbcSettings(runs=3, sequential=1, **{**SMALL, "seed": 4})
    with pytest.raises(ValueError, match="settings.seed is 3 in the run, but 4 was asked"):
        check_sbc(out, short_recording, settings=other, progress=False)
