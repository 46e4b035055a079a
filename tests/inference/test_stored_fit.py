"""A fit on disk: loaded elsewhere it concludes the same, bit for bit."""

import json
import subprocess
import sys
import zipfile

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import Fit

from bolfi_liquids import inference

HOW = {"budget": 14, "progress": False, "warn": False}
PRIORS = {
    "slope": dist.TruncatedNormal(0.2, 0.5, low=-1.0, high=1.0),
    "offset": dist.LogUniform(0.1, 2.0),
}


def distance(observed, simulated):
    return float(np.mean(np.abs(observed - simulated)))


def other(observed, simulated):
    return float(np.max(np.abs(observed - simulated)))


def assert_same(fit, again):
    u = np.random.default_rng(0).random((50, len(fit.prior)))
    theta = fit.prior.from_unit(u)
    np.testing.assert_array_equal(again.log_prob(theta), fit.log_prob(theta))
    assert (again.status, again.warnings, again.best) == (fit.status, fit.warnings, fit.best)
    assert again.confirmed == fit.confirmed and again.evidence == fit.evidence
    assert again.failures == fit.failures and again.prior.units == fit.prior.units
    assert fit.simulations.identical(again.simulations)
    tree, back = (one.sample("emcee", draws=20, warmup=20, warn=False) for one in (fit, again))
    for name in ("posterior", "prior_predictive", "log_likelihood", "emulator_checks"):
        for variable, values in tree[name].data_vars.items():
            np.testing.assert_array_equal(back[name][variable], values)
    attributes = {name for name in tree.attrs if not name.startswith(("seconds_", "created"))}
    assert {n: tree.attrs[n] for n in attributes} == {n: back.attrs[n] for n in attributes}


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"noise": np.float32(0.05), "varying_noise": np.True_},
        {"noise": np.full(30, 0.05), "misfit": 0.0},
        {"surrogate": "discrepancy", "threshold": "min_mean"},
    ],
    ids=["default", "a number", "an array", "discrepancy"],
)
def test_a_fit_is_the_same_after_the_disk(simulate, observed, tmp_path, options):
    prior = inference.Prior(PRIORS, units={"slope": "rad/s"})

    def failing(theta, seeds):
        made = simulate(theta, seeds)
        made[np.asarray(theta["offset"]) > 1.9] = np.nan
        return made

    fit = inference.fit(failing, prior, observed, **HOW, **options)
    assert fit.before is not None
    path = fit.save(tmp_path / "fit")
    assert path == tmp_path / "fit" and [one.name for one in tmp_path.iterdir()] == ["fit"]
    assert_same(fit, Fit.load(path))
    again = Fit.load(path)
    assert_same(fit, Fit.load(again.save(path)))
    with pytest.raises(ValueError, match="loaded"):
        again.check()


@pytest.mark.slow
def test_another_process_loads_the_same_bits(simulate, prior, observed, tmp_path):
    fit = inference.fit(simulate, prior, observed, **HOW)
    path = fit.save(tmp_path / "fit.zip")
    code = (
        "from bolfi_liquids import inference; "
        f"fit = inference.Fit.load({str(path)!r}); "
        "print(fit.log_prob({'slope': .3, 'offset': .6}).tobytes().hex(), fit.status)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    here = fit.log_prob({"slope": 0.3, "offset": 0.6}).tobytes().hex()
    assert done.stdout.strip() == f"{here} {fit.status}"


def test_functions_are_given_again_and_checked(simulate, prior, observed, tmp_path):
    fit = inference.fit(simulate, prior, observed, discrepancy=distance, **HOW)
    path = fit.save(tmp_path / "fit")
    assert_same(fit, Fit.load(path, discrepancy=distance))
    with pytest.raises(ValueError, match="discrepancy must be .*distance.*give load"):
        Fit.load(path)
    with pytest.raises(ValueError, match="discrepancy must be .*distance.*got.*other"):
        Fit.load(path, discrepancy=other)


def test_a_function_that_changed_under_its_name_is_refused(simulate, prior, observed, tmp_path):
    def loose(mean):
        return 0.1 + 0.0 * mean

    fit = inference.fit(simulate, prior, observed, noise=loose, **HOW)
    path = fit.save(tmp_path / "fit")
    assert_same(fit, Fit.load(path, noise=loose))

    def tight(mean):
        return 0.01 + 0.0 * mean

    tight.__qualname__ = loose.__qualname__
    with pytest.raises(ValueError, match="log_density"):
        Fit.load(path, noise=tight)


@pytest.mark.slow  # JAX compiles each operation of such a prior
def test_a_prior_that_cannot_be_written_is_given_again(simulate, observed, tmp_path):
    shift = dist.transforms.AffineTransform(0.5, 1.0)
    shifted = dist.TransformedDistribution(dist.Normal(0.0, 0.3), shift)
    prior = inference.Prior({"slope": shifted, "offset": dist.Uniform(0.0, 1.0)})
    fit = inference.fit(simulate, prior, observed, **HOW)
    path = fit.save(tmp_path / "fit")
    theta = {"slope": np.array([0.4, 0.7]), "offset": np.array([0.5, 0.6])}
    again = Fit.load(path, prior=prior)
    np.testing.assert_array_equal(again.log_prob(theta), fit.log_prob(theta))
    for wrong in (None, inference.Prior(PRIORS)):
        with pytest.raises(ValueError, match="prior must be .*AffineTransform"):
            Fit.load(path, prior=wrong)


def test_runs_of_unlike_shapes_are_kept(prior, observed, tmp_path):
    def uneven(theta, seeds):
        pairs = zip(theta["slope"], theta["offset"], strict=True)
        return [a * np.linspace(0.0, 1.0, 5 + int(6 * b)) + b for a, b in pairs]

    def ends(one, another):
        return float((one[-1] - another[-1]) ** 2 + (one[0] - another[0]) ** 2)

    fit = inference.fit(uneven, prior, observed, discrepancy=ends, **HOW)
    assert len({one.shape for one in fit.history.outputs}) > 1
    again = Fit.load(fit.save(tmp_path / "fit"), discrepancy=ends)
    for one, other in zip(fit.history.outputs, again.history.outputs, strict=True):
        np.testing.assert_array_equal(one, other)
    assert_same(fit, again)


def test_a_log_likelihood_is_kept(prior, tmp_path):
    def log_likelihood(theta, seeds):
        return -50.0 * (theta["slope"] - 0.2) ** 2 - 80.0 * (theta["offset"] - 0.5) ** 2

    fit = inference.fit(log_likelihood, prior, surrogate="log_likelihood", **HOW)
    assert_same(fit, Fit.load(fit.save(tmp_path / "fit")))


def test_another_engine_s_fit_and_other_files_are_refused(line_fit, tmp_path):
    path = line_fit.save(tmp_path / "fit")
    with zipfile.ZipFile(path) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    made = json.loads(held["fit.json"])
    made["engine_version"] = "0"
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in {**held, "fit.json": json.dumps(made)}.items():
            archive.writestr(name, content)
    with pytest.raises(ValueError, match=r"version 0 of the engine"):
        Fit.load(path)
    content = path.read_bytes()
    for damaged in (b"no archive", content[:-200], content[:2000] + b"x" * 400 + content[2400:]):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="Fit.save"):
            Fit.load(path)
    np.savez(tmp_path / "other.npz", a=1.0)
    with pytest.raises(ValueError, match="Fit.save"):
        Fit.load(tmp_path / "other.npz")
    with pytest.raises(FileNotFoundError):
        Fit.load(tmp_path / "none")


def test_another_surrogate_with_the_same_options_is_refused(line_fit, tmp_path):
    class Other(type(line_fit.family)):
        name = "other"

    path = line_fit.save(tmp_path / "fit")
    assert_same(line_fit, Fit.load(path, surrogate=line_fit.family))
    for wrong, named in ((Other(**vars(line_fit.family)), "other"), ("signal", "signal")):
        with pytest.raises(ValueError, match=f"surrogate must be 'discrepancy'.*got '{named}'"):
            Fit.load(path, surrogate=wrong)


def test_times_of_any_library_are_kept(line_fit, tmp_path):
    engine = inference.Bolfi(line_fit.prior, line_fit.observed)
    engine.tell(line_fit.prior.to_dict(line_fit.history.theta), line_fit.history.signals)
    fit = engine.fit({"simulator": np.float32(1.5)}, warn=False)
    assert Fit.load(fit.save(tmp_path / "fit")).seconds == fit.seconds
    with pytest.raises(ValueError, match=r"seconds\['simulator'\] must be a time"):
        engine.fit({"simulator": "long"})


def test_nothing_is_left_of_a_file_that_could_not_be_written(line_fit, tmp_path):
    with pytest.raises(OSError):
        line_fit.save(tmp_path)
    assert not list(tmp_path.parent.glob("*.part"))
