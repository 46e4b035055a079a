"""Validation cases run to their end; whether they pass is for `check physics` to say."""

import pytest

from bolfi_liquids.checks.physics import all_cases, check_physics

# a minute or more each: `make test-long` runs them, and so does `check physics`
LONG = ("adhesion", "couette", "cylinder_drag", "herschel_bulkley", "resolution")
OTHERS = sorted(set(all_cases()) - set(LONG))
CASES = [
    *(pytest.param(name, marks=pytest.mark.minutes) for name in LONG),
    *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS),
]


@pytest.mark.parametrize("name", CASES)
def test_a_case_runs_to_its_end(tmp_path, name):
    check = check_physics(tmp_path, [name], progress=False)
    (record,) = check.records
    assert record["error"] is None
    assert record["rows"] and (tmp_path / f"{name}.svg").exists()
