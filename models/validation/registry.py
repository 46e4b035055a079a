"""Cases are found by being there: one module each, named like its case."""

from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

from .case import Case


def discover(*packages: ModuleType) -> dict[str, Case]:
    """The cases of some packages by name, in alphabetical order within each package.

    A module whose name starts with an underscore holds what cases share.

    Raises:
        ValueError: a module defines no `CASE`, its case has another name, or two share a name.
    """
    found: dict[str, Case] = {}
    for package in packages:
        names = sorted(module.name for module in iter_modules(package.__path__))
        for name in (name for name in names if not name.startswith("_")):
            module = f"{package.__name__}.{name}"
            case = getattr(import_module(module), "CASE", None)
            if not isinstance(case, Case):
                raise ValueError(f"{module} must define CASE, a Case; got {case!r}")
            if case.name != name:
                raise ValueError(f"{module} must hold the case {name!r}, got {case.name!r}")
            if name in found:
                raise ValueError(f"two cases are named {name!r}; rename {module}")
            found[name] = case
    return found
