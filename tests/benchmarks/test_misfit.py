"""Subjects of the study of criticism, their data sets, and the tables, against what they claim."""

import data_sets
import numpy as np
import others
import pytest
import table
from kept import keep, results
from scipy.stats import multivariate_normal
from subject import alone, distance, signal_to_noise, size, two_sided, whitener
from subjects import SUBJECTS

ALPHA = 1e-4  # false alarms per test
REPEATS = 200


def middle(subject):
    """Base parameters in the middle of their priors."""
    values = subject.prior.from_unit(np.full((1, len(subject.prior)), 0.5))
    return {name: float(column[0]) for name, column in values.items()}


@pytest.fixture(params=SUBJECTS.values(), ids=list(SUBJECTS))
def subject(request):
    return request.param


# Every subject.


def test_a_subject_reads_every_coefficient_and_lacks_nothing_without_them(subject):
    base = middle(subject)
    for trial in (subject.fitted, subject.held_out):
        clean = trial.expected(alone(base))
        for name, extension in subject.effects.items():
            typical = float(extension.prior.icdf(0.8))
            changed = trial.expected(alone({**base, name: typical}))
            assert np.isfinite(changed).all()
            assert np.abs(changed - clean).max() > 1e-3 * np.abs(clean).max(), name
            np.testing.assert_allclose(trial.expected(alone({**base, name: 0.0})), clean)


def test_runs_depend_on_their_own_parameters_and_seed_alone(subject):
    u = np.random.default_rng(0).uniform(0.2, 0.8, (5, len(subject.prior)))
    columns, seeds = subject.prior.from_unit(u), np.arange(5)
    together = subject.fitted.simulate(columns, seeds)
    one = subject.fitted.simulate({name: v[3:4] for name, v in columns.items()}, seeds[3:4])
    np.testing.assert_allclose(together[3], one[0], rtol=1e-4, atol=1e-5)


def test_data_hold_the_noise_that_is_said(subject):
    """Whitened residuals of many observations have a mean square of 1, all in all and slowly."""
    theta, trial = middle(subject), subject.fitted
    white, clean = whitener(trial, theta), trial.expected(alone(theta))[0]
    left = [white @ (trial.observe(theta, seed) - clean).ravel() for seed in range(REPEATS)]
    moving = np.stack(left)[:, len(left[0]) // 4 :]  # a liquid at rest is quieter
    spread = np.sqrt(2.0 / moving.size)
    assert abs(np.mean(moving**2) - 1.0) < 4.0 * spread + 0.02  # counts are not quite Gaussian


# Signal-to-noise ratios.


@pytest.mark.parametrize("effect", ["drift", "gain"])
def test_an_effect_has_about_the_ratio_that_was_asked_for(effect):
    subject = SUBJECTS["oscillator"]
    base = middle(subject)
    white = whitener(subject.fitted, base)
    coefficient = size(subject, base, effect, 8.0, white)
    theta = {**base, effect: coefficient}
    visible, snr = signal_to_noise(subject, (effect,), theta, white)
    assert snr == pytest.approx(8.0, rel=0.25)
    rivals = [(name,) for name in subject.extensions if name != effect]
    assert snr == pytest.approx(min(distance(subject, one, theta, white) for one in rivals), 0.02)
    changed = subject.fitted.expected(alone(theta))
    whole = np.linalg.norm(white @ (changed - subject.fitted.expected(alone(base))).ravel())
    assert snr <= visible <= whole * (1.0 + 1e-6)


def test_effects_that_imitate_each_other_have_no_ratio():
    """A lag of the heater and one of the sensors commute in a rod that is linear."""
    subject = SUBJECTS["rod"]
    theta = {**middle(subject), "contact": 6.0}
    white = whitener(subject.fitted, theta)
    visible, snr = signal_to_noise(subject, ("contact",), theta, white)
    assert visible > 10.0 > 0.5 > snr


def test_what_the_model_reaches_is_at_no_distance():
    subject = SUBJECTS["rod"]
    theta = {**middle(subject), "heater": 0.05}
    white = whitener(subject.fitted, theta)
    assert distance(subject, ("heater",), theta, white) < 0.1
    assert distance(subject, (), theta, white) > 5.0


# Data sets.


def test_files_hold_the_sets_and_start_alike_however_many_are_made(tmp_path):
    made = [data_sets.make("rod", number) for number in (0, 4, 12, 13)]
    data_sets.saved(made).to_netcdf(tmp_path / "rod.nc", engine="h5netcdf")
    (found,) = data_sets.files(tmp_path)
    again = data_sets.make("rod", 12)
    np.testing.assert_array_equal(again.observed, found[2].observed)
    for one, other in zip(made, found, strict=True):
        assert (one.effects, one.theta, one.truth) == (other.effects, other.theta, other.truth)
        np.testing.assert_array_equal(one.held_out, other.held_out)


def test_every_kind_is_among_the_first_sets(subject):
    kinds = [kind for kind, _ in data_sets.kinds(subject)]
    assert {"", "pair", *subject.effects} == set(kinds[:80])
    assert kinds.count("") == data_sets.NULLS
    assert any(two_sided(one) for one in subject.extensions.values())
    assert not all(two_sided(one) for one in subject.extensions.values())


# Other methods.


def test_leave_one_out_is_each_value_given_the_others():
    rng = np.random.default_rng(0)
    slopes, noise = rng.normal(size=(6, 2)), np.diag(rng.uniform(0.5, 2.0, 6))
    fitted = others.Fitted(rng.normal(size=2), np.eye(2), rng.normal(size=6), slopes)
    data, (mean, covariance) = rng.normal(size=6), fitted.marginal(noise)
    whole = multivariate_normal.logpdf(data, mean, covariance)
    without = [np.delete(np.arange(6), k) for k in range(6)]
    expected = sum(
        whole - multivariate_normal.logpdf(data[k], mean[k], covariance[np.ix_(k, k)])
        for k in without
    )
    assert others.leave_one_out(data, fitted, noise) == pytest.approx(expected)


def test_the_best_fit_of_a_model_that_lacks_nothing_leaves_the_noise():
    one = data_sets.make("oscillator", 0)
    found, noise = others.models(one)
    white = np.linalg.inv(np.linalg.cholesky(noise))
    left = np.sum((white @ (one.observed.ravel() - found["none"].mean)) ** 2)
    freedom = len(noise) - 2
    assert abs(left - freedom) < 4.0 * np.sqrt(2.0 * freedom)
    assert np.abs(found["none"].z).max() < others.FAR
    assert others.discrepancy(one, found["none"], noise) < 0.5


# Tables.


def stated(seed, sharpness):
    """Results whose stated probabilities are right where sharpness is 1."""
    rng, names = np.random.default_rng(seed), ("none", "a", "b with c", "none of these")
    found = []
    for _ in range(2000):
        p = rng.dirichlet(np.full(4, 0.5))
        truth = names[rng.choice(4, p=p)]
        sharp = p**sharpness / np.sum(p**sharpness)
        found.append({"truth": truth, "probabilities": dict(zip(names, sharp, strict=True))})
    return found


@pytest.mark.parametrize(("sharpness", "holds"), [(1.0, True), (3.0, False), (0.3, False)])
def test_calibration_finds_probabilities_that_are_too_sure_or_not_sure_enough(sharpness, holds):
    """Six bands of .99 each: false alarms in one of 16 seeds at most; this one is fixed."""
    rows = table.calibration(stated(1, sharpness))
    assert all(row.endswith("| yes |") for row in rows[2:]) == holds


def test_scores_do_not_depend_on_the_order_of_names():
    one = {"truth": "c with b", "probabilities": {"b with c": 1.0, "none": 0.0}}
    assert table.brier(one) == 0.0
    assert table.brier({**one, "truth": "d"}) == 2.0


def test_a_study_goes_on_after_half_a_line(tmp_path):
    path = tmp_path / "study.jsonl"
    keep(path, {"number": 1})
    path.write_bytes(path.read_bytes() + b'{"numb')
    assert results(path) == [{"number": 1}]
    keep(path, {"number": 2})
    assert results(path) == [{"number": 1}, {"number": 2}]
