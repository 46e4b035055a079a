"""Representations of a fit show what it holds."""

from dataclasses import replace

import pytest
from bolfi_liquids.inference.simulations.failures import raised

from bolfi_liquids import inference

pytestmark = pytest.mark.slow


@pytest.fixture
def fit(simulate, prior, observed):
    return inference.fit(simulate, prior, observed, budget=9, warn=False, progress=False, noise=0.0)


def test_objects_tell_what_they_hold(fit, prior, observed):
    engine = inference.Bolfi(prior, observed)
    engine.ask(3)
    with inference.SimulationBank() as bank:
        failed = inference.simulations.Simulation(None, raised(OSError("<b>")), 0.0)
        bank.put("mine", {"a": 1.0}, 0, failed)
        shown = [(fit, "9"), (engine, "3 asked"), (bank, "1 simulations, 1 failed")]
        for value, part in shown:
            assert part in repr(value) and "<table>" in value._repr_html_()
            assert type(value).__name__ in repr(value)
    assert "closed" in repr(bank)


def test_a_surrogate_shows_its_prior_and_no_address(fit, prior):
    shown = repr(fit.surrogate)
    assert "0x" not in shown and all(name in shown for name in prior.names)


def test_fits_are_compared_without_an_error(fit):
    """By what they are: their arrays say no single yes or no."""
    other = replace(fit, seconds={})
    assert fit == fit and fit != other
    assert fit.surrogate.learned != replace(fit.learned)
