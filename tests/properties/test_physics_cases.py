"""Validation cases keep the tolerances that they state."""

import pytest

from bolfi_liquids.checks.physics import all_cases, check_physics

# those that take less than 15 s of processor time, seed 0; `make test-long` runs the others, and
# `check physics` all
IN_CI = (
    "camera_effects",
    "capillary_rise",
    "contact_angle",
    "dam_break",
    "falling_stream",
    "film_flow",
    "herschel_bulkley",
    "meniscus",
    "oscillating_drop",
    "pendulum_in_air",
    "retained_film",
    "rig_effects",
    "swirl_decay",
    "warming_swirl",
)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in IN_CI else pytest.mark.minutes)
        for name in sorted(all_cases())
    ],
)
def test_a_case_keeps_its_tolerances(tmp_path, name):
    (record,) = check_physics(tmp_path, [name], progress=False).records
    assert record["error"] is None
    missed = [row for row in record["rows"] if not row["passed"]]
    assert record["rows"] and not missed
    assert (tmp_path / f"{name}.svg").exists()


def test_the_cases_named_here_exist():
    assert set(IN_CI) <= set(all_cases())
