"""A criticism as it is opened, and the calibration that it extends."""

import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.calibration.bad_fit import bad_fit
from bolfi_liquids.calibration.posterior_file import write_tree
from bolfi_liquids.criticism.criticise import _learned_from
from bolfi_liquids.criticism.result import finished_criticism, latest_calibration
from bolfi_liquids.drawing import new_figure
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.settings import CriticismSettings
from bolfi_liquids.run.directory import CRITICISM
from bolfi_liquids.run.summary import read_summary, write_section


@pytest.fixture
def run(calibration, tmp_path):
    return shutil.copytree(calibration.path, tmp_path / "run")


@pytest.fixture
def criticised(run, made, made_from, criticism_summary):
    """A copy of a run, with a criticism that accepted an effect."""
    write_tree(made(held=True), run / CRITICISM)
    replace(criticism_summary, made_from=made_from).write(run)
    return run


@pytest.fixture
def extended(criticised):
    return bl.Criticism.open(criticised).calibration


def changed(run, **made_from):
    """Write down that the section was made from something else."""
    section = read_summary(run)["criticise"]
    write_section(run, "criticise", section | {"made_from": section["made_from"] | made_from})


def test_an_extended_calibration_shows_its_own_parameters(extended, calibration, criticised):
    criticism = bl.Criticism.open(criticised)
    assert extended.added == ("camera_delay",) and calibration.added == ()
    assert extended.summary.parameters == criticism.summary.parameters
    assert extended.best == criticism.summary.best
    assert "camera delay" in repr(extended) or "camera_delay" in repr(extended)
    assert (extended.summary.rhat_max, extended.summary.ess_min) == (1.002, 800.0)
    assert extended.summary.n_draws == extended.posterior["viscosity"].size
    assert set(extended.draws(4)) == {"viscosity", "cohesion", "camera_delay"}
    assert calibration.summary == bl.Calibration.open(criticised).summary  # left as it was


def test_its_search_is_that_of_the_base(extended):
    figure = new_figure(6.0, 6.0)
    assert extended.plot_search(figure.subplots(3, 1, squeeze=False)).shape == (3, 1)


@pytest.mark.slow
def test_an_effect_that_was_accepted_is_judged_by_the_fit_that_it_leaves(criticised):
    calibration = bl.Calibration.open(criticised)
    replace(calibration.summary, fit_rms_deg=2.0, noise_deg=0.2).write(criticised)
    assert bad_fit(bl.Calibration.open(criticised).summary) is not None
    assert bad_fit(latest_calibration(criticised).summary) is None
    for change in ({"rms_after": 2.0}, {"rms_after": None}):
        section = read_summary(criticised)["criticise"]
        section["gap_deg"] |= change
        write_section(criticised, "criticise", section)
        assert bad_fit(latest_calibration(criticised).summary) is not None


def test_an_effect_of_pours_alone_mends_no_stir(criticised):
    calibration = bl.Calibration.open(criticised)
    replace(calibration.summary, fit_rms_deg=2.0, noise_deg=0.2).write(criticised)
    section = read_summary(criticised)["criticise"]
    section["stirs"] |= {"verdict": "tie", "effects": ["stick_mass", "camera_tilt"]}
    write_section(criticised, "criticise", section)
    assert bad_fit(latest_calibration(criticised).summary) is not None


def test_plots_of_the_base_model_are_refused(extended, criticised):
    for plot in (extended.plot_fit, extended.plot_posterior):
        with pytest.raises(ValueError, match="camera_delay"):
            plot()
    bl.Criticism.open(criticised).base.plot_fit()


def test_it_can_be_criticised(extended, calibration):
    theta, signals, seeds = _learned_from(extended)
    assert set(theta) == {"viscosity", "cohesion"}
    np.testing.assert_array_equal(seeds, _learned_from(calibration)[2])
    assert len(signals) == len(seeds)


def test_results_travel(extended, criticised, pour):
    criticism = bl.Criticism.open(criticised)
    for one in (extended, criticism, pour):
        assert repr(pickle.loads(pickle.dumps(one))) == repr(one)
    again = pickle.loads(pickle.dumps(extended))
    np.testing.assert_array_equal(again.posterior["viscosity"], extended.posterior["viscosity"])
    with pytest.raises(TypeError):
        again.record["settings"] = {}


@pytest.mark.parametrize("read", [latest_calibration, bl.Criticism.open])
def test_a_criticism_of_another_form_is_refused_by_its_version(criticised, read):
    changed(criticised, format=99, version="7.8.9")
    with pytest.raises(InputError) as refused:
        read(criticised)
    assert "7.8.9" in str(refused.value) and "\n" not in str(refused.value)
    made_from = read_summary(criticised)["criticise"]["made_from"]
    assert (
        finished_criticism(bl.Calibration.open(criticised), made_from) is None
    )  # it is made again


def test_no_pour_is_chosen_from_half_of_what_is_known(criticised):
    changed(criticised, format=99)
    with pytest.raises(InputError):
        bl.choose_pour(criticised, progress=False)


def test_a_tree_beside_the_section_of_another_criticism_is_seen(criticised):
    """As after a kill between the two."""
    changed(criticised, settings={"effects": None})
    for read in (bl.Criticism.open, latest_calibration):
        with pytest.raises(InputError) as refused:
            read(criticised)
        assert refused.value.where == str(criticised / CRITICISM)
    made_from = read_summary(criticised)["criticise"]["made_from"]
    assert finished_criticism(bl.Calibration.open(criticised), made_from) is None


def test_a_section_that_lacks_a_field_says_its_version(criticised):
    section = read_summary(criticised)["criticise"]
    del section["noise"]
    write_section(criticised, "criticise", section)
    with pytest.raises(InputError, match=f"criticise.noise.*{bl.__version__}"):
        bl.Criticism.open(criticised)


def test_integers_of_numpy_are_settings():
    assert CriticismSettings(seed=np.int64(3)).seed == 3
