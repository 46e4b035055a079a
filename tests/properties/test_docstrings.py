"""Every public name has a docstring, and the examples of docstrings run."""

import sys
from doctest import DocTestFinder, DocTestRunner
from importlib import import_module
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from test_layout import ROOT, sources  # noqa: E402

WITH_EXAMPLES = [name for name, path in sources(ROOT).items() if ">>> " in path.read_text()]


def test_every_public_name_has_a_docstring():
    from public_names import docstring, exports

    of = {
        f"{package}.{name}": docstring(name, value)
        for package, names in exports().items()
        for name, value in names.items()
    }
    assert of
    assert all(of.values()), [name for name, text in of.items() if not text]


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_run(name):
    found = vars(import_module(name)).values()
    own = [one for one in found if getattr(one, "__module__", "") == name]
    runner = DocTestRunner()
    for one in own:
        for example in DocTestFinder().find(one, module=False):
            runner.run(example)
    assert runner.tries
    assert not runner.failures
