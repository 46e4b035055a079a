"""The guide's examples of ways into the engine run as they are printed, and the page is right."""

import os
import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import numpyro.distributions as dist
import optuna
import pytest

from bolfi_liquids import inference

GUIDE = files("bolfi_liquids.guide")
NUMBER = r"(\d+\.\d+)"


def run(text, folder, monkeypatch):
    """What its blocks define; one that begins with a file's name is written there instead."""
    monkeypatch.chdir(folder)
    names: dict = {"__name__": "__main__"}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        if named := re.match(r"# (\w+\.py)\n", block):
            (folder / named[1]).write_text(block)
        else:
            exec(compile(block, "guide", "exec"), names)
    return names


def section(page, title):
    text = (GUIDE / f"{page}.md").read_text(encoding="utf-8")
    return text.split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]


def moments(draws):
    """Name -> mean and sd."""
    return {name: (float(values.mean()), float(values.std())) for name, values in draws.items()}


def exact(prior, log_likelihood, cells):
    """Name -> mean and sd, by a grid of the prior's quantiles."""
    axis = (np.arange(cells) + 0.5) / cells
    theta = prior.from_unit(np.stack(np.meshgrid(*[axis] * len(prior)), -1).reshape(-1, len(prior)))
    values = log_likelihood(theta)
    weights = np.exp(values - values.max()) / np.exp(values - values.max()).sum()
    means = {name: weights @ column for name, column in theta.items()}
    return {n: (m, np.sqrt(weights @ (theta[n] - m) ** 2)) for n, m in means.items()}


def assert_told(page, found, true):
    """The page's first numbers after each name are what was found, then those that are exact."""
    text = " ".join((GUIDE / f"{page}.md").read_text(encoding="utf-8").split())
    one, two = found
    pattern = f"{one} {NUMBER} ± {NUMBER} and {two} {NUMBER} ± {NUMBER}.*? exact posterior.*?"
    told = re.search(f"{pattern}{NUMBER} ± {NUMBER} and {NUMBER} ± {NUMBER}", text).groups()
    flat = [value for moments in (found, true) for pair in moments.values() for value in pair]
    assert [float(number) for number in told] == pytest.approx(flat, abs=1.5e-3)


def assert_near(found, true, shift=0.2, ratio=1.15):
    for name, (mean, sd) in true.items():
        assert abs(found[name][0] - mean) < shift * sd, name
        assert 1.0 / ratio < found[name][1] / sd < ratio, name


def text(page):
    return (GUIDE / f"{page}.md").read_text(encoding="utf-8")


def row(page, title):
    """Numbers with decimals in the first line of a page that begins so."""
    line = next(one for one in text(page).splitlines() if one.startswith(title))
    return [float(number) for number in re.findall(r"-?\d+\.\d+", line)]


def assert_row(page, title, found):
    """A row's means and sds are those, name -> mean and sd, to a tenth of the sds."""
    told = np.reshape(row(page, title), (-1, 2))
    values = np.array(list(found.values()))
    assert (np.abs(told - values) < 0.1 * values[:, 1:]).all(), (told, values)


def nearest(theta, summaries, observed, kept):
    """Name -> mean and sd of the rejection posterior; distances in sds of the summaries."""
    distance = np.linalg.norm((summaries - observed) / summaries.std(axis=0), axis=1)
    return moments({name: of[np.argsort(distance)[:kept]] for name, of in theta.items()})


@pytest.mark.slow
def test_optimiser(tmp_path, monkeypatch, capsys):
    optuna.logging.set_verbosity(optuna.logging.CRITICAL)
    made = run((GUIDE / "optimiser.md").read_text(encoding="utf-8"), tmp_path, monkeypatch)
    true = exact(made["fit"].prior, lambda theta: made["log_likelihood"](theta, None), 400)
    assert_told("optimiser", moments(made["draws"]), true)
    assert made["confirmed"].status == capsys.readouterr().out.split()[-1] == "fitted"


@pytest.mark.slow
def test_program(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    made = run((GUIDE / "program.md").read_text(encoding="utf-8"), tmp_path, monkeypatch)

    def log_likelihood(theta):
        model = theta["start"][:, None] * 2 ** (-theta["rate"][:, None] * np.arange(20))
        return -0.5 * np.sum(((made["observed"] - model) / 0.1) ** 2, axis=1)

    found = moments(made["fit"].sample("quadrature")["posterior"])
    assert_told("program", found, exact(made["prior"], log_likelihood, 400))


def test_parameters_that_depend_on_one_another(tmp_path, monkeypatch):
    made = run(section("simulator", "Parameters"), tmp_path, monkeypatch)
    prior = made["prior"]
    assert prior.names == ("slow", "fast", "mean", "a", "b", "c")
    theta = prior.from_unit(np.random.default_rng(0).random((100, 6)))
    assert (theta["slow"] < theta["fast"]).all()
    grid = (np.stack(np.meshgrid(*[np.arange(40)] * 2), -1).reshape(-1, 2) + 0.5) / 40
    shares = made["shares"].from_unit(grid)
    a, b = shares["a"], shares["b"]
    assert (a + b < 1).all()
    found = [a.mean(), b.mean(), a.var(), np.cov(a, b)[0, 1]]
    assert np.allclose(found, [1 / 3, 1 / 3, 1 / 18, -1 / 36], atol=2e-3)  # of a uniform triangle


@pytest.mark.slow
def test_several_experiments(tmp_path, monkeypatch):
    imports = section("simulator", "Parameters").split("\n\n\ndef")[0] + "\n```"
    made = run(imports + section("simulator", "Several experiments"), tmp_path, monkeypatch)

    def log_likelihood(theta):
        return -0.5 * np.sum(
            ((made["observed"] - made["both"](theta, None)) / made["noise"]) ** 2, 1
        )

    found = moments(made["fit"].sample("emcee", draws=500)["posterior"])
    assert_near(found, exact(made["prior"], log_likelihood, 120))


@pytest.mark.slow
def test_elfi_s_tutorials(tmp_path, monkeypatch):
    """Ports beside rejection posteriors of as many summaries; of the third the truth is known."""
    elfi = run(text("elfi"), tmp_path, monkeypatch)
    rng, n = np.random.default_rng(0), 400_000
    height = np.sqrt(rng.random(n))
    theta = {"t1": (2 * rng.random(n) - 1) * 2 * height, "t2": 2 * height - 1}
    w, lags = rng.normal(size=(2, n)), np.zeros((n, 2))
    y = np.full((2, n), np.nan)
    for _ in range(100):
        w = np.stack([w[-2], w[-1], rng.normal(size=n)])
        y = np.stack([y[-2], y[-1], w[2] + theta["t1"] * w[1] + theta["t2"] * w[0]])
        lags += np.nan_to_num(y[2] * y[1::-1]).T / [99, 98]
    true = nearest(theta, lags, elfi["autocovariances"](elfi["observed"]), 2000)
    found = moments({name: elfi["draws"][name] for name in ("t1", "t2")})
    assert_row("elfi", "| rejection, the nearest 4000", true)
    assert_row("elfi", "| this engine, budget 50", found)
    assert_near(found, true, shift=0.7, ratio=1.5)
    options = {"summary": elfi["autocovariances"], "budget": 50, **elfi["one_by_one"]}
    for seed in (1, 2):
        other = inference.fit(
            elfi["ma2"], elfi["fit"].prior, elfi["observed"], seed=seed, **options
        )
        found = moments(other.sample("quadrature")["posterior"])
        t2 = 2 * found["height"][0] - 1, 2 * found["height"][1]
        assert_row("elfi", f"| | {seed} |", {"t1": found["t1"], "t2": t2})

    n = 60_000
    theta = inference.Prior(elfi["ranges"]).from_unit(rng.random((n, 3)))
    stock, counts = np.ones(n), []
    for _ in range(50):
        stock = stock * np.exp(theta["log_rate"] - stock + theta["sd"] * rng.normal(size=n))
        counts.append(rng.poisson(theta["scale"] * stock))
    summaries = np.stack([elfi["of_roots"](of) for of in np.array(counts).T])
    true = nearest(theta, summaries, elfi["of_roots"](elfi["counts"]), 150)
    assert_row("elfi", "| rejection, the nearest 150", true)
    found = moments(elfi["stocks"])
    assert_row("elfi", "| this engine, budget 100", found)
    assert_near(found, true, shift=0.7, ratio=1.5)

    assert elfi["hunted"].failures == {"unusable": 10}
    for name, truth in {"birth": 1.0, "hunt": 0.005, "death": 0.6}.items():
        low, middle, high = elfi["quantiles"][name].to_numpy()
        assert row("elfi", f"| {name} |")[:3] == pytest.approx([low, middle, high], rel=0.1)
        assert low < truth < high


@pytest.mark.slow
def test_sbi_s_first_tutorial(tmp_path, monkeypatch, capsys):
    made = run(text("sbi"), tmp_path, monkeypatch)
    found = moments(made["draws"])
    assert_near(found, {name: (0.0, 0.1) for name in made["names"]}, shift=0.3, ratio=1.2)
    told = re.findall(r"\b[abc] (-?\d\.\d+) ± (\d\.\d+)", text("sbi"))
    assert np.allclose(np.array(told, float), list(found.values()), atol=0.01)
    every = [*found.values()]
    for seed in (1, 2):
        data = np.ones(3)
        fit = inference.fit(made["simulate"], made["prior"], data, budget=60, noise=0, seed=seed)
        every += moments(fit.sample("emcee", draws=1000)["posterior"]).values()
    means, sds = zip(*every, strict=True)
    ends = [min(means), max(means), min(sds), max(sds)]
    assert np.allclose(row("sbi", "| this engine | 63 |"), ends, atol=0.01)


def test_asks_and_tells(tmp_path, monkeypatch, capsys):
    run(text("cluster"), tmp_path, monkeypatch)
    assert capsys.readouterr().out == "fitted\n"


EXECUTORS = """
import sys
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids import inference
from executorlib import SingleNodeExecutor
from executorlib.api import TestClusterExecutor

def simulate(theta, seed):
    return theta["slope"] * np.arange(9) + np.random.default_rng(seed).normal(size=9)

data, prior = np.arange(9.0), inference.Prior({"slope": dist.Uniform(0, 2)})
options = {"vectorised": False, "budget": 4, "initial": 3, "confirm": 0, "warn": False}
def signals(executor):
    return inference.fit(simulate, prior, data, executor=executor, **options).history.signals

with SingleNodeExecutor(max_workers=2, block_allocation=True) as kept:
    np.testing.assert_array_equal(signals(kept), signals(None))
with TestClusterExecutor(resource_dict={"cores": 1}, cache_directory="jobs") as files:
    np.testing.assert_array_equal(signals(files), signals(None))
"""


@pytest.mark.slow
def test_executors_of_the_cluster_page(tmp_path):
    """In a process of its own: importing executorlib warns."""
    subprocess.run([sys.executable, "-c", EXECUTORS], cwd=tmp_path, check=True, timeout=120)


def test_an_effect_of_your_own_simulator(tmp_path, monkeypatch):
    assert run(section("criticism", "In your own simulator"), tmp_path, monkeypatch)[
        "found"
    ].accepted == ("bend",)


def test_a_discrepancy_of_your_own(tmp_path, monkeypatch):
    imports = section("simulator", "Parameters").split("\n\n\ndef")[0] + "\n```"
    made = run(imports + section("simulator", "Surrogates"), tmp_path, monkeypatch)
    prior = inference.Prior({"a": dist.Uniform(0, 2)})
    data = np.linspace(0, 1, 40) + np.random.default_rng(0).normal(0, 0.1, 40)
    fit = inference.fit(
        lambda theta, seeds: theta["a"][:, None] * np.linspace(0, 1, 40),
        prior,
        data,
        surrogate=made["own"],
    )
    a = fit.simulations["a"].to_numpy()[:, None]
    squares = np.sum((a * np.linspace(0, 1, 40) - data) ** 2, axis=1)
    assert np.allclose(fit.history.discrepancy, squares)
    slope, sd = np.linalg.lstsq(np.linspace(0, 1, 40)[:, None], data)[0][0], 0.1 / np.sqrt(13.5)
    assert_near(moments(fit.sample("quadrature")["posterior"]), {"a": (slope, sd)}, 0.5, 1.5)


def test_cheap_runs(tmp_path, monkeypatch):
    made = run(section("simulator", "Cheap runs beside expensive ones"), tmp_path, monkeypatch)

    def log_likelihood(theta):
        return -0.5 * np.sum(((made["observed"] - made["decay"](theta, None)) / 0.05) ** 2, axis=1)

    assert made["fit"].status == "fitted"
    found = moments(made["fit"].sample("quadrature")["posterior"])
    assert_near(found, exact(made["fit"].prior, log_likelihood, 400))
