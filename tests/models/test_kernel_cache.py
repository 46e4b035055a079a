"""A process that was killed while it wrote compiled kernels costs no later one its cache."""

import os
import time

import pytest
from bolfi_liquids.models.runtime import STALE_S, remove_stale_lock


@pytest.mark.parametrize(("age", "stays"), [(2.0 * STALE_S, False), (0.0, True)])
def test_only_a_stale_lock_is_removed(tmp_path, age, stays):
    lock = tmp_path / "ticache.lock"
    lock.touch()
    os.utime(lock, (time.time() - age,) * 2)
    remove_stale_lock(tmp_path)
    assert lock.exists() == stays


def test_a_cache_that_is_not_there_is_no_error(tmp_path):
    remove_stale_lock(tmp_path / "none")
