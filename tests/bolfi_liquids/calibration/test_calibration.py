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
from bolfi_liquids.inference.simulations import job

import bolfi_liquids as bl
from bolfi_liquids import inference, models
from bolfi_liquids.calibration import calibrate as calibrating
from bolfi_liquids.calibration.engine_fit import PREDICTIVE_DRAWS, THETA_STAR_REPLICATES
from bolfi_liquids.calibration.figures import grid_density, marginal
from bolfi_liquids.drawing import new_figure
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.simulators import StirSimulator, stir_simulator


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


def test_run_toml_says_how_it_was_made(calibration, short_recording, settings):
    record = tomllib.loads((calibration.path / "run.toml").read_text())
    assert record["settings"]["seed"] == settings["seed"]
    assert record["settings"]["particles"] == settings["particles"]
    assert record["inputs"]["sha256"] == [bl.open_recording(short_recording).hash]
    assert record["versions"]["bolfi-liquids"] == bl.__version__
    assert record["simulator"]["recording_1"]["particles"] == settings["particles"]


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


def test_two_liquids_are_not_one_calibration(short_recording, dataset, tmp_path):
    water = tmp_path / "water.nc"
    dataset.assign_attrs(liquid_density=1000.0).to_netcdf(water)
    with pytest.raises(ValueError, match=r"water\.nc: attribute liquid_density: 1000.0 kg/m3"):
        bl.calibrate([short_recording, water], out=tmp_path / "run", progress=False)
    assert not (tmp_path / "run").exists()


def test_prior_with_another_parameter_is_refused(short_recording, tmp_path):
    prior = inference.Prior({"viscosity": dist.Uniform(0.1, 1.0), "cohesin": dist.Uniform(0, 1)})
    with pytest.raises(ValueError, match="viscosity, cohesin, expected viscosity, cohesion"):
        bl.calibrate(short_recording, out=tmp_path / "run", prior=prior, progress=False)
    assert not (tmp_path / "run").exists()


class Mine(dist.Uniform):
    """A distribution that numpyro does not have."""


def test_a_prior_that_a_run_could_not_be_resumed_with_is_refused(short_recording, tmp_path):
    prior = inference.Prior({"viscosity": Mine(0.1, 1.0), "cohesion": dist.Uniform(0.0, 1.0)})
    with pytest.raises(ValueError, match="prior of viscosity: .*cannot be written down"):
        bl.calibrate(short_recording, out=tmp_path / "run", prior=prior, progress=False)
    assert not (tmp_path / "run").exists()


def test_default_prior_covers_water_to_gel():
    theta = {"viscosity": np.array([1e-4, 1e-3, 12.0, 30.0]), "cohesion": np.full(4, 0.5)}
    np.testing.assert_array_equal(default_prior().contains(theta), [False, True, True, False])


def test_a_run_that_was_not_finished_sayshow_to_go_on(calibration, tmp_path):
    (tmp_path / "run.toml").write_bytes((calibration.path / "run.toml").read_bytes())
    with pytest.raises(ValueError, match="not finished.*--resume"):
        bl.Calibration.open(tmp_path)


def test_it_prints_its_quantiles_and_whether_the_sampler_converged(calibration):
    said = repr(calibration)
    assert str(calibration.path) in said and str(calibration.summary.sampler_status) in said
    for name, values in calibration.summary.parameters.items():
        assert name in said and f"{values.q50:.3g}" in said
        assert f"{values.q95:.3g}" in calibration._repr_html_()


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
    (count,) = re.findall(r"simulating stirs: (\S+) to run", capsys.readouterr().err)
    assert int(count) == 0
    assert again.summary.parameters == calibration.summary.parameters


def test_an_aborted_recording_is_logged(short_recording, tmp_path, monkeypatch, caplog):
    aborted = tmp_path / "aborted.nc"
    with xr.open_dataset(short_recording, decode_times=False) as whole:
        whole.assign_attrs(status="aborted", reason="protective stop").to_netcdf(aborted)
    monkeypatch.setattr(calibrating, "_calibrate", lambda *_: None)
    with pytest.raises(InputError, match="not finished"):
        bl.calibrate([short_recording, aborted], out=tmp_path / "run", progress=False)
    (notice,) = caplog.records
    assert str(aborted) in notice.getMessage() and "protective stop" in notice.getMessage()


def test_settings_may_be_integers_of_numpy(short_recording, calibration, settings):
    """They are those of the run, which is only opened."""
    given = {name: np.int64(value) for name, value in settings.items()}
    again = bl.calibrate(
        short_recording, out=calibration.path, resume=True, progress=False, **given
    )
    assert again.summary == calibration.summary


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.surrogates.warnings.EmulatorWarning")
def test_stirs_that_take_too_long_are_counted_and_their_limit_is_kept(
    short_recording, settings, tmp_path, monkeypatch, caplog
):
    simulate, calls = StirSimulator.simulate, []

    def slow(self, theta, seeds):
        calls.append(seeds)
        if len(calls) in (1, 2):  # the first batch together, then its first alone
            raise models.TimeLimitExceeded
        return simulate(self, theta, seeds)

    monkeypatch.setattr(StirSimulator, "simulate", slow)
    monkeypatch.setattr(job, "within", given_up)
    made = bl.calibrate(
        short_recording, out=tmp_path / "run", timeout=600.0, progress=False, **settings
    )
    notices = [one.args for one in caplog.records if one.name.endswith("run.simulations")]
    learned = made.tree["simulations"].sizes["simulation"]
    assert notices == [(1, learned, 600.0)]


def given_up(timeout, call, limit=None):
    """As if the time were over where the simulator says so."""
    try:
        return call()
    except TimeoutError as error:
        raise job.Overdue from error


def test_without_a_directory_a_run_is_among_the_temporary_files(short_recording, monkeypatch):
    found = []

    def begun(run, *_):
        found.append((run.path, (run.path / "run.toml").is_file()))

    monkeypatch.setattr(calibrating, "_calibrate", begun)
    with pytest.raises(InputError, match="not finished"):
        bl.calibrate(short_recording, progress=False)
    ((run, has_begun),) = found
    assert has_begun
    assert str(run).startswith(tempfile.gettempdir())
    shutil.rmtree(run)


@pytest.mark.slow
def test_a_notebook_shows_every_plot(calibration):
    """The plots return axes, and each figure is shown all the same."""
    opened = f"import bolfi_liquids as bl\nrun = bl.Calibration.open({str(calibration.path)!r})"
    cells = [opened, "run.plot_posterior();", "run.plot_fit();", "run.plot_search();"]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(c) for c in cells])
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    for cell in notebook.cells[1:]:
        assert any("image/png" in output.get("data", {}) for output in cell.outputs)
