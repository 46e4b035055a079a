"""Validation cases keep the tolerances that they state; those known to miss are named below."""

from typing import NamedTuple

import pytest

from bolfi_liquids.checks.physics import all_cases, check_physics

# those that take less than 15 s of processor time, seed 0; `make test-long` runs the others, and
# `check physics` all
IN_CI = (
    "pendulum_in_air",
    "swirl_decay",
    "capillary_rise",
    "contact_angle",
    "dam_break",
    "falling_stream",
    "film_flow",
    "meniscus",
    "oscillating_drop",
    "retained_film",
)
WORSE = 1.25  # times the error below that a missed comparison may have, on another computer

HALF_A_CELL_OFF = "walls rub by the speed of the lowest faces"
TUNED = "the stick's drag was tuned to the recorded stirs; as published it keeps more"


class Miss(NamedTuple):
    """A comparison beyond its case's tolerance: the error measured at seed 0, and the reason."""

    error: float
    reason: str
    everywhere: bool = True  # or on some processors alone, where rounding decides


MISSES = {
    "buoyancy": {
        "torque at 8 deg [N m]": Miss(-0.304, TUNED),
        "torque at 15 deg [N m]": Miss(0.166, TUNED),
        "torque at 25 deg [N m]": Miss(0.101, TUNED),
        "torque at 8 deg, drag as published [N m]": Miss(-0.228, "why is not known"),
    },
    "film_flow": {
        "mean speed, 2 cells thick [m/s]": Miss(0.126, HALF_A_CELL_OFF),
        "mean speed, 1 cells thick [m/s]": Miss(0.414, HALF_A_CELL_OFF),
        "mean speed, 0.5 cells thick [m/s]": Miss(1.25, HALF_A_CELL_OFF),
        "mean speed, 0.25 cells thick [m/s]": Miss(3.17, HALF_A_CELL_OFF),
    },
    "hydrostatic_column": {
        "speed at 0.003 Pa s, cohesion 0 [m/s]": Miss(0.0657, "thin deep liquid keeps moving"),
        "density at 0.003 Pa s, cohesion 0": Miss(0.032, "its tolerance is 0.03", everywhere=False),
        "density at 0.003 Pa s, cohesion 1": Miss(0.0361, "thin deep liquid keeps moving"),
        "speed at 0.003 Pa s, cohesion 1 [m/s]": Miss(0.0759, "thin deep liquid keeps moving"),
    },
}


def judge(record, known):
    """Raise AssertionError unless a case's record keeps its tolerances but for the known misses.

    Those must miss, or their entries are out of date, to the side where they were measured, and by
    no more.
    """
    assert record["error"] is None, record["error"]
    rows = {row["quantity"]: row for row in record["rows"]}
    assert rows and known.keys() <= rows.keys()
    new = {name: row for name, row in rows.items() if not row["passed"] and name not in known}
    assert not new, new
    for name, miss in known.items():
        healed = rows[name]["passed"] and miss.everywhere
        assert not healed, f"{name} keeps its tolerance now: take it off MISSES"
        error = rows[name]["error"]  # None where a simulation failed
        assert error is not None and abs(error) <= WORSE * abs(miss.error), rows[name]
        assert rows[name]["passed"] or error * miss.error > 0, rows[name]


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in IN_CI else pytest.mark.minutes)
        for name in sorted(all_cases())
    ],
)
def test_a_case_keeps_its_tolerances(tmp_path, name):
    """A miss ends in xfail, and is strict: `judge` fails where it no longer misses."""
    (record,) = check_physics(tmp_path, [name], progress=False).records
    known = MISSES.get(name, {})
    judge(record, known)
    assert (tmp_path / f"{name}.svg").exists()
    if known:
        rows = {row["quantity"]: row for row in record["rows"]}
        pytest.xfail(
            "; ".join(
                f"{quantity}: error {rows[quantity]['error']:.3g}, tolerance "
                f"{rows[quantity]['tolerance']:g} ({miss.reason})"
                for quantity, miss in known.items()
            )
        )


def test_the_cases_named_here_exist():
    assert {*IN_CI, *MISSES} <= set(all_cases())


def made(**errors):
    """A record of comparisons with these errors, of tolerance 0.1."""
    rows = [
        {"quantity": name, "error": error, "passed": error is not None and abs(error) <= 0.1}
        for name, error in errors.items()
    ]
    return {"error": None, "rows": rows}


def test_a_record_as_it_is_known_passes():
    judge(made(mass=0.05, speed=-0.31), {"speed": Miss(-0.3, "a reason")})


@pytest.mark.parametrize(
    "record",
    [
        made(mass=0.11, speed=-0.3),  # a new miss
        made(mass=None, speed=-0.3),  # a simulation that failed
        made(mass=0.05, speed=0.05),  # a miss that healed
        made(mass=0.05, speed=-0.4),  # one that grew
        made(mass=0.05, speed=0.3),  # one that changed sides
        made(mass=0.05, speed=None),
        made(mass=0.05),  # a comparison that is gone
        made(mass=0.05, speed=-0.3) | {"error": "RuntimeError: broken"},
    ],
)
def test_every_fault_of_a_record_is_caught(record):
    with pytest.raises(AssertionError):
        judge(record, {"speed": Miss(-0.3, "a reason")})
