"""What a study tells of its phases."""

import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.study import Study
from bolfi_liquids.inference.simulations import Compute

from bolfi_liquids import inference

PRIOR = inference.Prior({"level": dist.Uniform(-2.0, 2.0)})


def level(theta, seeds):
    return theta["level"][:, None] + np.zeros((len(seeds), 20))


def test_a_phase_begins_with_its_total_and_ends_when_all_are_made():
    told = []
    experiment = criticism.Experiment(level, np.zeros(20), criticism.KnownNoise(0.1))
    study = Study(experiment, PRIOR, {}, Compute(batch=2), report=lambda *of: told.append(of))
    thetas = [{"level": np.linspace(-1.0, 1.0, n)} for n in (3, 2)]
    study.run_each("looks", thetas)
    assert told[0] == ("looks", 0, 5) and {total for _, _, total in told} == {5}
    assert sum(finished for _, finished, _ in told) == 5
