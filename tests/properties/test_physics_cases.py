"""Every validation case runs to its end; whether it passes is for `check physics` to say."""

import pytest

from bolfi_liquids.physics_check import all_cases, check_physics

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", all_cases())
def test_a_case_runs_to_its_end(tmp_path, name):
    check = check_physics(tmp_path, [name], progress=False)
    (record,) = check.records
    assert record["error"] is None
    assert record["rows"] and (tmp_path / f"{name}.svg").exists()
