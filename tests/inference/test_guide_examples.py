"""The guide's examples of ways into the engine run as they are printed, and the page is right."""

import os
import re
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import optuna
import pytest

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
    prior = run(section("simulator", "Parameters"), tmp_path, monkeypatch)["prior"]
    assert prior.names == ("slow", "fast", "mean", "a", "b", "c")
    theta = prior.from_unit(np.random.default_rng(0).random((100, 6)))
    assert (theta["slow"] < theta["fast"]).all()


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
def test_cheap_runs(tmp_path, monkeypatch):
    made = run(section("simulator", "Cheap runs help dear ones"), tmp_path, monkeypatch)

    def log_likelihood(theta):
        return -0.5 * np.sum(((made["observed"] - made["decay"](theta, None)) / 0.05) ** 2, axis=1)

    assert made["fit"].status == "fitted"
    found = moments(made["fit"].sample("quadrature")["posterior"])
    assert_near(found, exact(made["fit"].prior, log_likelihood, 400))
