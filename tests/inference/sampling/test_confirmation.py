"""When runs at draws of a posterior confirm it."""

from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.inference.sampling.confirmation import Before

DRAWN = np.array([[1.0], [2.0], [3.0], [4.0]])
KNOWN, ZERO, ONE = 12, np.zeros(1), np.ones(1)


def history(outputs, theta=DRAWN):
    """Two runs that were told before, one elsewhere, and the runs at theta with these outputs."""
    told = np.concatenate([[[9.0], [8.0], [7.0]], theta])
    made = np.concatenate([np.zeros((3, 2)), outputs])
    return SimpleNamespace(
        theta=told,
        u=told,
        features=made,
        discrepancy=made.sum(1),
        succeeded=np.isfinite(made).all(1),
    )


def before(sd):
    """Outputs of 0 and of this sd are predicted everywhere."""
    learned = SimpleNamespace(
        u=np.zeros((KNOWN, 1)),
        predicted=lambda features, discrepancy: features,
        predict=lambda u: (np.zeros((len(u), 2)), np.tile(np.array(sd, float), (len(u), 1))),
    )
    return Before(ZERO, ONE, learned, told=2, drawn=DRAWN)


def outputs(*sizes):
    return np.array(sizes)[:, None] * np.ones(2)


@pytest.mark.parametrize(
    ("made", "mean", "sd", "holds"),
    [
        (outputs(0.5, -0.5, 1.0, 0.0), 0.9, 1.0, True),
        (outputs(0.5, -0.5, 1.0, 0.0), 1.1, 1.0, False),
        (outputs(0.5, -0.5, 1.0, 0.0), 0.0, 2.1, False),
        (outputs(0.5, -0.5, 1.0, 9.0), 0.01, 1.01, True),  # a surprise that changes nothing
        (outputs(0.5, -0.5, 1.0, 9.0), 0.2, 1.0, False),
        (outputs(0.5, -0.5, np.nan, np.nan), 0.9, 1.0, True),
        (outputs(0.5, np.nan, np.nan, np.nan), 0.0, 1.0, False),
    ],
)
def test_a_posterior_holds_where_runs_at_its_draws_do_not_move_it(made, mean, sd, holds):
    found = before((1.0, 1.0)).holds(history(made), np.array([mean]), np.array([sd]))
    assert found is holds


def test_what_was_constant_and_is_not_is_a_surprise():
    same, other = outputs(0.0, 0.0, 0.0, 0.0), outputs(0.0, 0.0, 0.0, 1e-6)
    moved = np.full(1, 0.2), ONE
    assert before((0.0, 1.0)).holds(history(same), *moved)
    assert not before((0.0, 1.0)).holds(history(other), *moved)


def test_runs_elsewhere_do_not_confirm():
    """The runs are known by their parameters; half of them must have come back."""
    posterior = before((1.0, 1.0))
    made = history(outputs(0.0, 0.0), DRAWN[[2, 0]])
    np.testing.assert_array_equal(posterior.runs(made), [3, 4])
    assert posterior.holds(made, ZERO, ONE)
    assert posterior.holds(history(outputs(0.0), DRAWN[:1]), ZERO, ONE) is None
    assert posterior.holds(history(outputs(0.0, 0.0, 0.0), DRAWN[:3] + 0.1), ZERO, ONE) is None
