"""What a calibration writes, and that it is what it says."""

import json
import re
import shutil
import tempfile
import tomllib

import nbclient
import nbformat
import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr
from arviz_stats.base.array import array_stats

import bolfi_liquids as bl
from bolfi_liquids import inference, models
from bolfi_liquids.calibration import calibrate as calibrating
from bolfi_liquids.calibration.engine_fit import PREDICTIVE_DRAWS, THETA_STAR_REPLICATES
from bolfi_liquids.calibration.figures import grid_density, marginal
from bolfi_liquids.drawing import new_figure
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.simulators import stir_simulator

SHORT = 60  # samples of `short_recording`


def test_summary_is_of_the_posterior(calibration, settings):
    section = json.loads((calibration.path / "summary.json").read_text())["calibrate"]
    tree = xr.open_datatree(calibration.path / "posterior.nc")
    for name, values in section["parameters"].items():
        draws = tree["posterior"][name].to_numpy()
        assert values["mean"] == pytest.approx(draws.mean())
        assert values["q05"] == pytest.approx(np.quantile(draws, 0.05))
        assert values["q05"] < values["q50"] < values["q95"]
    rhats = [float(array_stats.rhat(draws)) for draws in tree["posterior"].values()]
    assert section["rhat_max"] == pytest.approx(max(rhats))
    residual = tree["recorded"]["inclination"] - tree["closest"]["inclination"]
    rms = np.degrees(np.sqrt((residual**2).mean()))
    assert section["fit_rms_deg"] == pytest.approx(float(rms))
    assert 0.05 < section["noise_deg"] < 2.0  # 0.1 degrees of camera noise, and the seeds'
    assert section["n_simulations"] == settings["budget"]
    confirming = tree["simulations"].sizes["simulation"] - settings["budget"]
    rounds = tree["simulations"]["round"].to_numpy()
    assert (np.diff(rounds) >= 0).all() and rounds[-confirming] == rounds[-confirming - 1] + 1
    assert confirming in (PREDICTIVE_DRAWS, 2 * PREDICTIVE_DRAWS)
    assert section["n_check_simulations"] == confirming + THETA_STAR_REPLICATES
    tree.close()


def test_summary_says_below_which_viscosity_liquids_look_alike(
    calibration, short_recording, settings
):
    recording = bl.open_recording(short_recording)
    setup = models.StirSetup.from_recording(recording, settings["particles"])
    density = recording.number("liquid_density")
    floor = calibration.summary.least_viscosity
    assert floor == pytest.approx(setup.least_viscosity(density))
    assert calibration.tree.attrs["least_viscosity"] == floor
    draws = calibration.posterior["viscosity"].to_numpy()
    assert calibration.summary.below_least_viscosity == pytest.approx((draws < floor).mean())


def test_run_toml_says_how_it_was_made(calibration, short_recording, settings):
    record = tomllib.loads((calibration.path / "run.toml").read_text())
    assert record["settings"]["seed"] == settings["seed"]
    assert record["settings"]["particles"] == settings["particles"]
    assert record["inputs"]["sha256"] == [bl.open_recording(short_recording).hash]
    assert record["versions"]["bolfi-liquids"] == bl.__version__
    assert record["simulator"]["recording_1"]["particles"] == settings["particles"]


def test_closest_is_of_the_posterior_draws_and_reproducible(calibration, short_recording, settings):
    stirring = stir_simulator([bl.open_recording(short_recording)], settings["particles"])
    drawn = calibration.tree["posterior_predictive"]["inclination"].to_numpy()[0]
    discrepancies = [stirring.discrepancy()(stirring.observed, signal) for signal in drawn]
    at = int(np.argmin(discrepancies))
    assert float(calibration.tree["closest"]["discrepancy"]) == discrepancies[at]
    learned = calibration.tree["simulations"].isel(simulation=slice(-PREDICTIVE_DRAWS, None))
    np.testing.assert_array_equal(learned["signal"], drawn)
    theta = {name: np.array([value]) for name, value in calibration.summary.closest.items()}
    for name, values in theta.items():
        assert values[0] == learned[name].to_numpy()[at]
    again = stirring.simulate(theta, learned["seed"].to_numpy()[[at]])
    np.testing.assert_array_equal(again[0], calibration.tree["closest"]["inclination"])


def test_the_grid_of_a_narrow_posterior_resolves_it(calibration):
    """Mean and sd of the marginal over the grid are those of the draws."""
    density, (x, y) = grid_density(calibration.tree["surface"].to_dataset())
    mass = marginal(density, x, y) * np.gradient(x)
    mean = mass @ x / mass.sum()
    drawn = np.log(calibration.posterior["viscosity"].to_numpy())
    assert abs(mean - drawn.mean()) < 0.1 * drawn.std()
    assert np.sqrt(mass @ (x - mean) ** 2 / mass.sum()) == pytest.approx(drawn.std(), rel=0.1)


def test_several_recordings_add_up(short_recording, dataset, tmp_path, rng, settings):
    other = tmp_path / "other.nc"
    dataset.isel(time=slice(0, 40)).to_netcdf(other)
    pair = [bl.open_recording(short_recording), bl.open_recording(other)]
    both = stir_simulator(pair, settings["particles"])
    assert both.observed.shape == (100, 2)
    simulated = both.observed + 0.01 * rng.normal(size=both.observed.shape)
    parts = [stir_simulator([recording], settings["particles"]) for recording in pair]
    alone = [
        part.discrepancy()(part.observed, signal)
        for part, signal in zip(parts, np.split(simulated, [60]), strict=True)
    ]
    assert both.discrepancy()(both.observed, simulated) == pytest.approx(sum(alone))
    assert len({both.identity, *(part.identity for part in parts)}) == 3


class Mine(dist.Uniform):
    """A distribution that numpyro does not have."""


def changed(**attrs):
    return lambda dataset: dataset.assign_attrs(attrs)


def first(start, stop, step=None):
    return lambda dataset: dataset.isel(time=slice(start, stop, step))


def prior_of(**distributions):
    return {"prior": inference.Prior(distributions)}


UNIT = dist.Uniform(0.1, 1.0)


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"other": changed(liquid_density=1000.0)}, "other.nc: attribute liquid_density"),
        ({"other": first(0, SHORT)}, "short.nc"),  # given twice
        ({"baseline": first(None, None, 2)}, "baseline"),
        ({"baseline": changed(cup_radius=0.05)}, "cup_radius"),
        ({"baseline": first(10, None)}, "baseline.nc"),  # does not rest before it stirs
        ({"baseline": first(0, SHORT)}, "baseline.*would count as free of errors"),
        ({"baseline": first(0, None), "surrogate": "discrepancy"}, "baseline"),
        (prior_of(viscosity=UNIT, cohesin=UNIT), "cohesin"),
        (prior_of(viscosity=Mine(0.1, 1.0), cohesion=UNIT), "viscosity"),
    ],
)
def test_what_cannot_be_used_is_refused_by_its_name_before_anything_is_written(
    short_recording, dataset, tmp_path, given, field
):
    options = dict(given)
    for name in {"other", "baseline"} & set(given):
        options[name] = tmp_path / f"{name}.nc"
        given[name](dataset).to_netcdf(options[name])
    recordings = [short_recording, *([options.pop("other")] if "other" in given else [])]
    with pytest.raises(InputError, match=field):
        bl.calibrate(recordings, out=tmp_path / "run", progress=False, **options)
    assert not (tmp_path / "run").exists()


def test_default_prior_covers_water_to_gel():
    theta = {"viscosity": np.array([1e-4, 1e-3, 12.0, 30.0]), "cohesion": np.full(4, 0.5)}
    np.testing.assert_array_equal(default_prior().contains(theta), [False, True, True, False])


def test_it_prints_its_quantiles_and_opens_as_it_was_made(calibration, short_recording, settings):
    said = repr(calibration)
    assert str(calibration.path) in said and str(calibration.summary.sampler_status) in said
    for name, values in calibration.summary.parameters.items():
        assert name in said and f"{values.q50:.3g}" in said
        assert f"{values.q95:.3g}" in calibration._repr_html_()
    given = {name: np.int64(value) for name, value in settings.items()}
    again = bl.calibrate(
        short_recording, out=calibration.path, resume=True, progress=False, **given
    )
    assert again.summary == calibration.summary


@pytest.mark.parametrize(
    ("plot", "shape"), [("plot_fit", (1, 2)), ("plot_posterior", (1, 1)), ("plot_search", (3, 1))]
)
def test_plots_draw_in_axes_that_are_given_or_in_their_own(calibration, plot, shape):
    own = getattr(calibration, plot)()
    assert all(axes.figure is own.flat[0].figure for axes in own.flat)
    figure = new_figure(6.0, 6.0)
    given = figure.subplots(*shape, squeeze=False)
    drawn = getattr(calibration, plot)(given if given.size > 1 else given[0, 0])
    assert [*drawn.flat] == [*given.flat]
    assert all(axes.has_data() for axes in given.flat)


@pytest.mark.slow
def test_what_the_bank_holds_beside_stirs_is_not_counted(
    short_recording, calibration, settings, pour, tmp_path, capsys
):
    """A calibration whose results were deleted after a pour was chosen."""
    run = tmp_path / "run"
    shutil.copytree(pour.path, run)
    (run / "posterior.nc").unlink()
    again = bl.calibrate(short_recording, out=run, resume=True, **settings)
    (counts,) = re.findall(r"simulating stirs, (\d+) of at least (\d+)", capsys.readouterr().err)
    needed = settings["budget"] + PREDICTIVE_DRAWS + THETA_STAR_REPLICATES
    assert counts == ("0", str(needed))
    assert again.summary.parameters == calibration.summary.parameters


def test_a_run_begins_in_a_temporary_directory_and_says_that_a_recording_was_aborted(
    short_recording, tmp_path, monkeypatch, caplog
):
    aborted, found = tmp_path / "aborted.nc", []
    with xr.open_dataset(short_recording, decode_times=False) as whole:
        whole.assign_attrs(status="aborted", reason="protective stop").to_netcdf(aborted)
    monkeypatch.setattr(calibrating, "_calibrate", lambda run, *_: found.append(run.path))
    with pytest.raises(InputError, match="not finished"):
        bl.calibrate([short_recording, aborted], progress=False)
    (notice,) = caplog.records
    assert str(aborted) in notice.getMessage() and "protective stop" in notice.getMessage()
    assert str(found[0]).startswith(tempfile.gettempdir()) and (found[0] / "run.toml").is_file()
    shutil.rmtree(found[0])


@pytest.mark.slow
def test_a_notebook_shows_every_plot(calibration):
    """The plots return axes, and each figure is shown all the same."""
    opened = f"import bolfi_liquids as bl\nrun = bl.Calibration.open({str(calibration.path)!r})"
    cells = [opened, "run.plot_posterior();", "run.plot_fit();", "run.plot_search();"]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(c) for c in cells])
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    for cell in notebook.cells[1:]:
        assert any("image/png" in output.get("data", {}) for output in cell.outputs)
