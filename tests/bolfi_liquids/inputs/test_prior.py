"""A prior is the same after it was written into a run.toml and read."""

import tomllib

import numpy as np
import numpyro.distributions as dist
import pytest
import tomli_w
from bolfi_liquids.inference import Prior

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.prior import (
    check_prior,
    default_prior,
    describe_prior,
    read_prior,
)

U = np.random.default_rng(0).random((16, 2))


def with_viscosity(distribution: dist.Distribution) -> Prior:
    return Prior({"viscosity": distribution, "cohesion": dist.Uniform(0.0, 1.0)})


@pytest.mark.parametrize(
    "prior",
    [
        default_prior(),
        with_viscosity(dist.LogNormal(-1.0, 0.3)),
        with_viscosity(dist.TruncatedNormal(1.0, 0.5, low=0.1)),
        with_viscosity(dist.TruncatedNormal(1.0, 0.5, low=0.1, high=2.0)),
    ],
)
def test_a_prior_survives_its_file(prior):
    check_prior(prior)
    again = read_prior(tomllib.loads(tomli_w.dumps(describe_prior(prior))))
    for name, values in prior.from_unit(U).items():
        np.testing.assert_allclose(again.from_unit(U)[name], values, rtol=1e-6)


def test_a_table_names_family_and_arguments_and_may_be_written_by_hand():
    table = {"family": "LogUniform", "low": 3e-4, "high": 20.0}
    assert describe_prior(default_prior())["viscosity"] == table
    written = {"family": "TruncatedNormal", "loc": 1.0, "scale": 0.5, "low": 0.1}
    values = read_prior({"viscosity": written}).from_unit(U[:, :1])["viscosity"]
    expected = Prior({"viscosity": dist.TruncatedNormal(1.0, 0.5, low=0.1)}).from_unit(U[:, :1])
    np.testing.assert_array_equal(values, expected["viscosity"])
    with pytest.raises(ValueError, match="Mine"):
        read_prior({"viscosity": {"family": "Mine", "low": 1.0}})


SHIFTED = dist.TransformedDistribution(
    dist.Normal(0.0, 0.1), dist.transforms.AffineTransform(3.0, 1.0)
)


@pytest.mark.parametrize(
    ("prior", "said"),
    [
        (with_viscosity(SHIFTED), "prior of viscosity: .*written down"),
        (with_viscosity(dist.Normal(1.0, 1.0)), "prior of viscosity: Normal goes from -2"),
        (
            Prior({"viscosity": dist.LogUniform(0.1, 1.0), "cohesion": dist.Uniform(0.0, 2.0)}),
            "prior of cohesion: .*within 0 to 1",
        ),
        (Prior({"viscosity": dist.LogUniform(0.1, 1.0)}), "prior: viscosity, expected"),
        ({"viscosity": 1.0}, "prior: dict, expected"),
    ],
    ids=["shifted", "negative", "beyond", "missing", "dict"],
)
def test_a_prior_that_no_liquid_can_have_is_refused(prior, said):
    with pytest.raises(InputError, match=said):
        check_prior(prior)
