"""Posteriors from losses and from log likelihoods, beside the same by a grid."""

import re
from importlib.resources import files

import numpy as np
import numpyro.distributions as dist
import optuna
import pandas as pd
import pytest
from bolfi_liquids.inference.surrogates.discrepancy import is_outlier
from bolfi_liquids.inference.surrogates.log_likelihood import compressed, expanded
from bolfi_liquids.inference.surrogates.warnings import NEGATIVE, UNCERTAIN

from bolfi_liquids import inference

TIME = np.linspace(0.0, 5.0, 30)
SD = 0.2
DATA = 3.0 * np.exp(-0.8 * TIME) + SD * np.random.default_rng(4).normal(size=30)
DECAY = inference.Prior({"height": dist.Uniform(0.5, 6), "rate": dist.Uniform(0.05, 3)})
BOX = inference.Prior({"a": dist.Uniform(-3, 3), "b": dist.Uniform(-2, 6)})
QUIET = {"progress": False, "warn": False}


def losses(theta):
    model = theta["height"][:, None] * np.exp(-theta["rate"][:, None] * TIME)
    return np.sum((model - DATA) ** 2, axis=1)


def trials():
    """Sixty trials as an optimiser leaves them: dense near the best, and three that failed."""
    rng = np.random.default_rng(5)
    height = np.r_[rng.uniform(0.5, 6, 25), np.clip(3 + 0.3 * rng.normal(size=35), 0.5, 6)]
    rate = np.r_[rng.uniform(0.05, 3, 25), np.clip(0.8 + 0.12 * rng.normal(size=35), 0.05, 3)]
    theta = {"height": height, "rate": rate}
    loss = losses(theta)
    loss[[3, 30, 50]] = np.nan
    return theta, loss


def exact(prior, log_likelihood):
    """Parameters on a grid of the prior, and their weights in the posterior."""
    u = np.stack(np.meshgrid(*[(np.arange(400) + 0.5) / 400] * 2), -1).reshape(-1, 2)
    theta = prior.from_unit(u)
    values = log_likelihood(theta)
    return theta, np.exp(values - values.max()) / np.exp(values - values.max()).sum()


def moments(fit, log_likelihood):
    """Shift of the means in exact sds, and ratio of the sds, beside a grid of the prior."""
    theta, weights = exact(fit.prior, log_likelihood)
    drawn = fit.sample("quadrature", warn=False)["posterior"]
    found = []
    for name, column in theta.items():
        mean = weights @ column
        sd = np.sqrt(weights @ (column - mean) ** 2)
        draws = drawn[name].to_numpy()
        found.append(((draws.mean() - mean) / sd, draws.std() / sd))
    return np.abs(np.array(found)[:, 0]).max(), np.array(found)[:, 1]


def assert_near(fit, log_likelihood, shift=0.5, ratio=1.5):
    off, ratios = moments(fit, log_likelihood)
    assert off < shift and (ratios < ratio).all() and (ratios > 1.0 / ratio).all(), (off, ratios)


def banana(theta):
    return -0.5 * (theta["a"] / 0.7) ** 2 - 0.5 * ((theta["b"] - theta["a"] ** 2) / 0.3) ** 2


def round_hill(theta):
    return -0.5 * (theta["a"] / 0.4) ** 2 - 0.5 * ((theta["b"] - 2.0) / 0.5) ** 2


def beside_a_cliff(theta):
    return np.where(theta["a"] > 0.1, -np.inf, round_hill(theta))


def test_a_table_of_losses_with_known_and_unknown_noise():
    theta, loss = trials()
    known = inference.fit_losses(theta, loss, DECAY, noise=SD)
    assert_near(known, lambda t: -0.5 * losses(t) / SD**2, 0.1, 1.1)
    assert known.failures == {"not finite": 3}
    unknown = inference.fit_losses(theta, loss, DECAY, n=30)
    assert_near(unknown, lambda t: -15.0 * np.log(losses(t)), 0.1, 1.1)
    off, _ = moments(inference.fit_losses(theta, loss, DECAY, noise=SD), lambda t: -losses(t))
    ratios = moments(known, lambda t: -0.5 * losses(t) / (3.0 * SD) ** 2)[1]
    assert off < 1.0 and (ratios < 0.5).all()  # a wrong noise would be seen


def test_quantiles_without_sampling():
    fit = inference.fit_losses(*trials(), DECAY, noise=SD)
    theta, weights = exact(DECAY, lambda t: -0.5 * losses(t) / SD**2)
    levels = (0.05, 0.5, 0.95)
    for name, found in fit.quantiles(levels).items():
        columns, of = np.unique(theta[name], return_inverse=True)
        mass = np.bincount(of, weights)
        below = np.interp(found, columns, np.cumsum(mass) - 0.5 * mass)  # a cell's middle
        assert below == pytest.approx(levels, abs=0.02)


def narrow(theta):
    """Its sds are 1 and 2 % of the box; the median of its depths is 2,000 nats."""
    return -0.5 * ((theta["a"] - 0.4) / 0.06) ** 2 - 0.5 * ((theta["b"] - theta["a"]) / 0.16) ** 2


def far_table(seed):
    rng = np.random.default_rng(seed)
    theta = {"a": rng.uniform(-3, 3, 60), "b": rng.uniform(-2, 6, 60)}
    return inference.fit_losses(theta, -2.0 * narrow(theta), BOX, noise=1, warn=False)


def test_a_table_far_from_a_narrow_posterior():
    """A quadratic form is seen as it is; that it rises far above all runs is warned of."""
    for seed, far in ((0, True), (3, True), (4, False)):
        fit = far_table(seed)
        assert_near(fit, narrow, 0.2, 1.2)
        assert (fit.closest.discrepancy > 10.0) == far == (UNCERTAIN in fit.warnings)


def test_depths_do_not_spoil_the_top():
    """Millions of nats below the best, where the model is off, too."""

    def steep(theta):
        far = np.maximum(np.abs(theta["a"]) - 1.5, 0.0)
        return round_hill(theta) - 1e4 * far**3

    fit = inference.fit(lambda t, s: steep(t), BOX, surrogate="log_likelihood", budget=30, **QUIET)
    assert_near(fit, steep, 0.2, 1.2)


def noisy(log_likelihood, sd, told=False):
    def simulate(theta, seeds):
        noise = np.array([np.random.default_rng(seed).normal() for seed in seeds])
        values = log_likelihood(theta) + sd * noise
        return np.stack([values, np.full(len(seeds), sd)], -1) if told else values

    return simulate


def test_a_banana():
    fit = inference.fit(
        noisy(banana, 0.0), BOX, surrogate="log_likelihood", budget=60, seed=1, **QUIET
    )
    assert_near(fit, banana, 0.2, 1.25)


@pytest.mark.parametrize(("sd", "told"), [(3.0, False), (1.0, True)])
def test_noisy_log_likelihoods(sd, told):
    fit = inference.fit(
        noisy(round_hill, sd, told), BOX, surrogate="log_likelihood", budget=60, **QUIET
    )
    assert_near(fit, round_hill, 1.0, 2.0)


def test_impossible_beyond_an_edge():
    fit = inference.fit(
        lambda theta, seeds: beside_a_cliff(theta),
        BOX,
        surrogate="log_likelihood",
        budget=50,
        **QUIET,
    )
    assert_near(fit, beside_a_cliff, 0.5, 1.5)
    assert fit.failures.keys() == {"impossible"}
    assert not any("failed" in said for said in fit.warnings)


def test_what_is_not_known_explains_nothing():
    """Runs in a corner; the rest of the box, which none has seen, gets no mass."""
    u = 0.3 * np.random.default_rng(0).random((30, 2))
    theta = BOX.from_unit(u)
    values = -0.5 * np.sum(((u - 0.15) / 0.04) ** 2, axis=1)
    fit = inference.fit(
        None, BOX, surrogate="log_likelihood", budget=0, earlier=(theta, values), warn=False
    )
    drawn = fit.sample("quadrature", warn=False)["posterior"]
    far = (drawn["a"] > BOX.from_unit(np.full(2, 0.4))["a"]) | (drawn["b"] > 1.2)
    assert far.mean() < 0.01
    rough = np.random.default_rng(1).normal(0.0, 10.0, 30)  # nothing can be learned of these
    told = inference.fit(
        None, BOX, surrogate="log_likelihood", budget=0, earlier=(theta, rough), warn=False
    )
    assert UNCERTAIN in told.warnings and UNCERTAIN not in fit.warnings


def test_depths_are_compressed_and_back():
    depth = np.array([-5.0, 0.0, 39.0, 41.0, 1e3, 1e9])
    np.testing.assert_allclose(expanded(compressed(depth, 40.0), 40.0), depth)
    assert compressed(np.array([1e16]), 40.0) < 2000.0


def test_most_runs_may_have_blown_up():
    few = np.r_[np.arange(5.0), np.full(8, 1e16), np.nan]
    np.testing.assert_array_equal(is_outlier(few), few == 1e16)
    assert not is_outlier(np.zeros(4)).any() and not is_outlier(np.full(3, np.nan)).any()


def test_losses_as_output_are_sent_to_fit_losses():
    theta, loss = trials()
    with pytest.raises(ValueError, match="observed number, 0, lies below all 57 .* fit_losses"):
        inference.fit(None, DECAY, [0.0], budget=0, earlier=(theta, loss[:, None]), **QUIET)

    def simulate(theta, seeds):
        return losses(theta)[:, None]

    fit = inference.fit(simulate, DECAY, [0.0], budget=40, confirm=0, **QUIET)
    assert any("fit_losses" in said for said in fit.warnings)
    assert fit.status != "fitted"


def test_minus_a_log_likelihood_as_discrepancy_is_sent_to_log_likelihood():
    theta, loss = trials()
    given = {"budget": 0, "earlier": (theta, -1.0 - loss[:, None]), **QUIET}
    for sign in (1.0, -1.0):
        fit = inference.fit(
            None, DECAY, [0.0], discrepancy=lambda _, run, s=sign: s * float(run[0]), **given
        )
        assert (NEGATIVE in fit.warnings) == (sign > 0.0) and "log_likelihood" in NEGATIVE


def test_a_simulator_of_log_likelihoods_returns_one_or_two_numbers():
    with pytest.raises(ValueError, match=r"two with its sd, got a signal of \(3,\)"):
        inference.fit(lambda t, s: np.zeros((len(s), 3)), BOX, surrogate="log_likelihood")
    with pytest.raises(ValueError, match="observed must be .*fit_losses"):
        inference.fit(noisy(banana, 0.0), BOX)


def study_of(objective, n=60, seed=0, **how):
    optuna.logging.set_verbosity(optuna.logging.CRITICAL)
    made = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed), **how)
    made.optimize(objective, n_trials=n)
    return made


def decay_loss(trial):
    """The loss of two parameters; two trials in ten fail or are pruned."""
    theta = {
        "height": np.array([trial.suggest_float("height", 0.5, 6)]),
        "rate": np.array([trial.suggest_float("rate", 0.05, 3, log=True)]),
    }
    if trial.number % 10 == 3:
        return np.nan
    if trial.number % 10 == 7:
        raise optuna.TrialPruned
    return float(losses(theta)[0])


@pytest.fixture(scope="module")
def study():
    return study_of(decay_loss)


def decay_log_likelihood(theta):
    return -0.5 * losses(theta) / SD**2


def test_a_study_s_trials_give_the_posterior_within_its_search_ranges(study):
    fit = inference.from_trials(None, study, noise=SD)
    assert str(fit.prior) == (
        "Prior({'height': Uniform(low=0.5, high=6), 'rate': LogUniform(low=0.05, high=3)})"
    )
    assert len(fit.history.theta) == 54 and fit.failures == {"not finite": 6}
    assert_near(fit, decay_log_likelihood, 0.1, 1.1)
    assert moments(fit, lambda t: decay_log_likelihood(t) / 4.0)[1].max() < 0.6  # a wrong noise
    unknown = inference.from_trials(DECAY, study, n=30)
    assert unknown.prior is DECAY
    assert_near(unknown, lambda t: -15.0 * np.log(losses(t)), 0.3, 1.2)


@pytest.mark.parametrize(("direction", "sign"), [("minimize", -1.0), ("maximize", 1.0)])
def test_a_study_of_the_log_likelihood_itself(direction, sign):
    def objective(trial):
        theta = {"a": trial.suggest_float("a", -3, 3), "b": trial.suggest_float("b", -2, 6)}
        return sign * round_hill(theta)

    fit = inference.from_trials(None, study_of(objective, direction=direction), log_likelihood=True)
    assert_near(fit, round_hill, 0.1, 1.1)


def test_a_frame_and_its_file_give_what_the_study_gives(study, tmp_path):
    done = [trial for trial in study.trials if trial.state.name == "COMPLETE"]
    frame = pd.DataFrame([{**trial.params, "loss": trial.value} for trial in done]).assign(rank=0)
    frame.to_csv(tmp_path / "trials.csv")
    given = (frame, tmp_path / "trials.csv", str(tmp_path / "trials.csv"))
    fits = [inference.from_trials(DECAY, one, noise=SD) for one in given]
    expected = inference.fit_losses(frame[["height", "rate"]], frame["loss"], DECAY, noise=SD)
    u = np.random.default_rng(0).random((20, 2))
    for fit in fits:
        at = DECAY.from_unit(u)
        np.testing.assert_array_equal(fit.log_prob(at), expected.log_prob(at))


def test_a_parameter_is_not_taken_for_the_losses():
    prior = inference.Prior({"loss": dist.Uniform(0.0, 1.0), "gain": dist.Uniform(0.0, 1.0)})
    table = {name: np.linspace(0.1, 0.9, 9) for name in prior.names}
    with pytest.raises(ValueError, match="no parameter `loss`.*rename"):
        inference.from_trials(prior, table, noise=0.1)


def of_whole_numbers(trial):
    return trial.suggest_float("a", -3, 3) ** 2 + trial.suggest_int("layers", 1, 3)


def of_choices(trial):
    return trial.suggest_float("a", -3, 3) ** 2 + len(
        trial.suggest_categorical("kind", ["x", "yy"])
    )


def of_one_value(trial):
    return trial.suggest_float("a", -3, 3) ** 2 + trial.suggest_float("b", 1, 1)


def of_branches(trial):
    a = trial.suggest_float("a", -3, 3)
    return a**2 if trial.number % 2 else a**2 + trial.suggest_float("b", -2, 6) ** 2


def of_changing_ranges(trial):
    return trial.suggest_float("a", -3, 3 + trial.number) ** 2


def of_two_objectives(trial):
    return trial.suggest_float("a", -3, 3), 1.0


@pytest.mark.parametrize(
    ("objective", "how", "told"),
    [
        (of_whole_numbers, {}, r"'layers' .* got IntDistribution.* Uniform\(0.5, 20.5\)"),
        (of_choices, {}, "'kind' .* got CategoricalDistribution.* give a prior"),
        (of_one_value, {}, "'b' .* got FloatDistribution.* without parameters of one value"),
        (of_branches, {}, r"all have the parameters .* data frame"),
        (of_changing_ranges, {}, r"all choose 'a' from FloatDistribution.* give a prior"),
        (of_two_objectives, {"directions": ["minimize"] * 2}, "one objective"),
        (lambda trial: np.nan, {}, "hold complete ones.*optimise first"),
    ],
)
@pytest.mark.filterwarnings("ignore::optuna.exceptions.ExperimentalWarning")
def test_a_study_that_says_no_posterior_is_refused_with_the_cure(objective, how, told):
    made = study_of(objective, n=12, **how)
    with pytest.raises(ValueError, match=f"(?s)trials must .*{told}"):
        inference.from_trials(None, made, noise=1.0)


def test_a_study_is_read_with_a_prior_of_its_own_parameters_alone():
    made = study_of(of_whole_numbers, n=12)
    with pytest.raises(ValueError, match=r"prior must have the parameters .*'layers'"):
        inference.from_trials(inference.Prior({"a": dist.Uniform(-3, 3)}), made, noise=1.0)


def test_whole_numbers_are_read_with_a_prior():
    made = study_of(of_whole_numbers, n=12)
    prior = inference.Prior({"a": dist.Uniform(-3, 3), "layers": dist.Uniform(0.5, 3.5)})
    fit = inference.from_trials(prior, made, noise=1.0, warn=False)
    assert set(np.unique(fit.history.theta[:, 1])) <= {1.0, 2.0, 3.0}


def test_the_guide_s_example():
    page = (files("bolfi_liquids.guide") / "simulator.md").read_text(encoding="utf-8")
    section = page.split("\n## Losses and log likelihoods\n", 1)[1].split("\n## ", 1)[0]
    (block,) = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    made: dict = {}
    exec(block, made)

    def exact(t):
        return -12.5 * (20 * (t["a"] - 1.2) ** 2 + 30 * (t["b"] - t["a"] ** 2 / 2) ** 2)

    assert_near(made["fit"], exact, 0.3, 1.3)
