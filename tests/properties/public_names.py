"""What the stubs `__init__.pyi` make public, for the test of docstrings and for the site."""

import sys
from importlib import import_module
from inspect import cleandoc, isclass, isfunction, ismodule
from typing import Any

from sphinx.pycode import ModuleAnalyzer
from test_layout import APPLICATION, ROOT, sources


def exports() -> dict[str, dict[str, Any]]:
    """Package -> name -> object; packages above come first."""
    stubs = [name for name, path in sources(ROOT).items() if path.with_suffix(".pyi").is_file()]
    packages = [import_module(name) for name in sorted(stubs, key=lambda name: name.count("."))]
    return {
        package.__name__: {
            name: value for name in package.__all__ if not ismodule(value := getattr(package, name))
        }
        for package in packages
    }


def homes() -> dict[int, tuple[str, str]]:
    """Each public object once: its id -> the first package that exports it, and its name there."""
    found: dict[int, tuple[str, str]] = {}
    for package, names in exports().items():
        for name, value in names.items():
            found.setdefault(id(value), (package, name))
    return found


def is_constant(value: object) -> bool:
    return not (isclass(value) or isfunction(value))


def docstring(name: str, value: Any) -> str:
    """Of a class or a function, or the text below a constant; "" where there is none."""
    if not is_constant(value):
        return cleandoc(value.__doc__ or "")
    ours = [one for one in sys.modules if one.startswith(f"{APPLICATION}.")]
    holding = [one for one in ours if vars(sys.modules[one]).get(name) is value]
    told = [ModuleAnalyzer.for_module(one).find_attr_docs().get(("", name)) for one in holding]
    return "\n".join(next(filter(None, told), ()))
