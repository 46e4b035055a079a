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
        with_viscosity(dist.Gamma(2.0, 3.0)),
        with_viscosity(dist.TruncatedNormal(1.0, 0.5, low=0.1)),
        with_viscosity(dist.TruncatedNormal(1.0, 0.5, low=0.1, high=2.0)),
        with_viscosity(dist.TruncatedCauchy(1.0, 0.5, low=0.1)),
    ],
)
def test_a_prior_survives_its_file(prior):
    check_prior(prior)
    again = read_prior(tomllib.loads(tomli_w.dumps(describe_prior(prior))))
    for name, values in prior.from_unit(U).items():
        np.testing.assert_allclose(again.from_unit(U)[name], values, rtol=1e-6)


def test_a_table_names_family_and_arguments():
    assert describe_prior(default_prior())["viscosity"] == {
        "family": "LogUniform",
        "low": 3e-4,
        "high": 20.0,
    }


def test_a_person_may_write_any_function_of_numpyro():
    written = {"family": "TruncatedNormal", "loc": 1.0, "scale": 0.5, "low": 0.1}
    values = read_prior({"viscosity": written}).from_unit(U[:, :1])["viscosity"]
    expected = Prior({"viscosity": dist.TruncatedNormal(1.0, 0.5, low=0.1)}).from_unit(U[:, :1])
    np.testing.assert_array_equal(values, expected["viscosity"])


def test_a_prior_that_nothing_describes_is_refused():
    with pytest.raises(ValueError, match="Mine"):
        read_prior({"viscosity": {"family": "Mine", "low": 1.0}})


def test_a_distribution_whose_numbers_do_not_make_it_is_refused():
    shifted = dist.TransformedDistribution(
        dist.Normal(0.0, 1.0), dist.transforms.AffineTransform(3.0, 1.0)
    )
    with pytest.raises(InputError, match="prior of viscosity"):
        check_prior(with_viscosity(shifted))
