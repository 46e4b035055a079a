"""What the punctual tests' repetition may hide, and what not."""

import subprocess
import sys
from pathlib import Path

import pytest

# {failures}: how often each test fails; {disturbed}: whether the computer stood still meanwhile
TESTS = """
import sys
import pytest

conftest = next(one for one in sys.modules.values() if hasattr(one, "_Stillness"))
conftest._Stillness.disturbed = lambda _: {disturbed}
conftest.CALM = conftest.MOST_CALM = 0.0
tries = dict.fromkeys(range({tests}), 0)

@pytest.fixture(scope="module")
def prepared():
    tries["fixture"] = tries.get("fixture", 0) + 1
    assert tries["fixture"] > {failures}

@pytest.mark.punctual
@pytest.mark.parametrize("number", tries)
def test_that_fails_at_first(number):
    tries[number] += 1
    assert tries[number] > {failures}

@pytest.mark.skipif({tests} != 1, reason="counted above")
@pytest.mark.punctual
def test_whose_fixture_fails_at_first(prepared):
    pass
"""


@pytest.mark.parametrize(
    ("disturbed", "tests", "failures", "code", "said"),
    [
        (True, 1, 1, 0, "repeats: 2"),
        (True, 3, 1, 0, "repeats: 3"),
        (True, 4, 1, 1, "repeats: 4"),
        (True, 1, 2, 1, "repeats: 2"),
        (False, 2, 1, 1, "2 failed"),
        (True, 1, 0, 0, "2 passed"),
    ],
    ids=["test and fixture", "a few", "too many", "fails twice", "fails in peace", "passes"],
)
def test_a_failure_is_repeated_once_and_seldom(tmp_path, disturbed, tests, failures, code, said):
    (tmp_path / "conftest.py").write_text((Path(__file__).parent / "conftest.py").read_text())
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    text = TESTS.format(disturbed=disturbed, tests=tests, failures=failures)
    (tmp_path / "hardware").mkdir()
    (tmp_path / "hardware" / "test_punctual.py").write_text(text)
    command = [sys.executable, "-m", "pytest", "-p", "no:randomly", str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60.0)
    assert done.returncode == code, done.stdout + done.stderr
    assert said in done.stdout
