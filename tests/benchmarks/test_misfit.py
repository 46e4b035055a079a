"""The harness of the study of criticism: it goes on where it stopped, and repeats nothing."""

import json
from collections import Counter

import numpy as np
import pytest
from misfit import study


class Here:
    """A pool that examines in this process, and dies after `budget` data sets."""

    examined: list
    budget = 10**6

    def __init__(self, workers, mp_context=None):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return False

    def map(self, function, sets, chunksize=1):
        for one in sets:
            if len(self.examined) >= self.budget:
                raise KeyboardInterrupt
            self.examined.append(one)
            yield {"effect": one[0], "strength": one[1], "number": one[2], "p_value": 0.5}


@pytest.fixture
def pool(monkeypatch):
    """The study in small, its data sets not examined but counted."""
    monkeypatch.setattr(study, "ProcessPoolExecutor", Here)
    monkeypatch.setattr(study, "NULLS", 6)
    monkeypatch.setattr(study, "SETS", 2)
    monkeypatch.setattr(study, "OUTSIDE_SETS", 1)
    monkeypatch.setattr(Here, "examined", [], raising=False)
    return Here


def finish(path, budget=10**6):
    Here.budget = budget
    try:
        return list(study.run(path, 1))
    except KeyboardInterrupt:
        return None


def key(result):
    return result["effect"], result["strength"], result["number"]


def test_a_study_examines_every_data_set_once(pool, tmp_path):
    sets = study.all_sets()
    strengths = len(study.STRENGTHS)
    expected = 6 + strengths * (2 * len(study.EXTENSIONS) + len(study.UNKNOWN))
    assert len(sets) == len(set(sets)) == expected
    results = finish(tmp_path / "study.jsonl")
    assert Counter(map(key, results)) == Counter(sets)
    assert study.results(tmp_path / "study.jsonl") == results


@pytest.mark.parametrize("torn", ["", '{"effect": "", "stren', "{"], ids=["whole", "half", "brace"])
def test_an_interrupted_study_goes_on_and_repeats_nothing(pool, tmp_path, torn):
    """Also where the last line was being written."""
    path = tmp_path / "study.jsonl"
    assert finish(path, budget=5) is None
    with path.open("a") as file:
        file.write(torn)
    assert len(study.results(path)) == 5
    finish(path)
    kept = [key(result) for result in study.results(path)]
    assert Counter(kept) == Counter(study.all_sets())
    assert Counter(pool.examined) == Counter(kept)


def test_a_line_that_lacks_its_end_only_is_not_lost_by_what_follows(pool, tmp_path):
    """A whole result without its line break, and the next one, are two."""
    path = tmp_path / "study.jsonl"
    finish(path, budget=5)
    path.write_text(path.read_text().rstrip("\n"))
    finish(path)
    assert Counter(map(key, study.results(path))) == Counter(study.all_sets())


def test_every_line_that_is_kept_is_one_result(pool, tmp_path):
    path = tmp_path / "study.jsonl"
    finish(path)
    lines = path.read_text().splitlines()
    assert [json.loads(line) for line in lines] == study.results(path)


# The data sets.


@pytest.mark.parametrize(("effect", "strength"), [("tilt", 2.5), ("friction", 6.0), ("swirl", 2.5)])
def test_an_effect_changes_the_inclination_as_much_as_asked(effect, strength):
    base = {"drag": 2.0, "eddy": 0.3}
    coefficient = study._coefficient(base, effect, strength, np.random.default_rng(0))
    assert study._change(base, effect, coefficient) == pytest.approx(strength, rel=0.01)
    assert study._change(base, effect, 0.0) == 0.0


def test_the_base_parameters_absorb_part_of_an_effect():
    """A tilt is none of theirs; what is left is no more than what it changes."""
    base = {"drag": 2.0, "eddy": 0.3}
    exact = study._exact
    coefficient = study._coefficient(base, "fill", 2.5, np.random.default_rng(0))
    left = study._snr(base, "fill", coefficient)
    root = np.linalg.inv(np.linalg.cholesky(study.stand_in.covariance()))
    changed = exact(study.FIRST, {**base, "fill": coefficient}) - exact(study.FIRST, base)
    assert 0.0 < left < 0.7 * np.linalg.norm(root @ changed)


def test_data_hold_the_noise_that_is_said():
    """Variance at the slowest frequencies of many observations, against `covariance`."""
    stir, base = study.FIRST, {"drag": 2.0, "eddy": 0.3}
    clean = study._exact(stir, base)
    moving = slice(90, 240)  # the liquid's own error has its full size
    noise = np.stack([(stir.observe(base, seed) - clean)[moving] for seed in range(200)])
    expected = study.stand_in.covariance()[moving, moving]
    modes = np.cos(np.pi * np.arange(1, 9) * (np.arange(150)[:, None] + 0.5) / 150.0)
    seen = np.mean(np.einsum("stc,tk->sck", noise, modes) ** 2, (0, 1))
    ratio = seen / np.sum(modes * (expected @ modes), 0)
    assert np.abs(ratio - 1.0).max() < 4.5 * np.sqrt(2.0 / 400)
