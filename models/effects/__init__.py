"""The registry of effects. Every module in this folder is one effect, named like its file.

The files that `BOLFI_LIQUIDS_EFFECTS` names define others.
"""

import hashlib
import importlib
import inspect
import os
import pkgutil
import secrets
from collections.abc import Mapping
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType

from ..effect import HOOKS, Effect
from ..effect_check import check_effect

OWN_EFFECTS = "BOLFI_LIQUIDS_EFFECTS"
"""Environment variable that names files of effects of one's own, separated as in PATH. Each defines
`EFFECT`, and every process that simulates loads it."""

NO_EFFECT = "it must be a Python file that defines EFFECT, a models.Effect"

_registered: dict[str, Effect] = {}
_digests: dict[str, str] = {}

EFFECTS: Mapping[str, Effect] = MappingProxyType(_registered)
"""Every effect by name: the built-in ones in alphabetical order, then those registered since."""


def register(effect: Effect) -> Effect:
    """Try an effect, add it to `EFFECTS` for the life of this process, and return it.

    Worker processes start afresh: an effect from outside has to be registered there as well, by
    the variable `OWN_EFFECTS` or by the module that defines what they run.

    Raises:
        ValueError: it is no `Effect`, its name is taken, or its prior or a hook breaks the rules
            (`effect_check`). A rheology is tried when a scene is first compiled with it.
    """
    return _registered_from(effect, None)


def _registered_from(effect: Effect, loaded: Path | None) -> Effect:
    """See `register`; `loaded` is the file that was loaded for it, if any."""
    if not isinstance(effect, Effect):
        raise ValueError(f"register wants a models.Effect, got {effect!r}")
    if effect.name in _registered:
        raise ValueError(
            f"there is already an effect {effect.name!r} ({_registered[effect.name].text}); "
            "choose another name"
        )
    check_effect(effect)
    _digests[effect.name] = _digest(effect, loaded)
    _registered[effect.name] = effect
    return effect


def own_effects() -> dict[str, str]:
    """Digest of the files that define each effect that is not built in: of its hooks, and of the
    one that was loaded. An effect without a file has another one each time it is registered."""
    return {name: digest for name, digest in _digests.items() if name in _registered}


def _digest(effect: Effect, loaded: Path | None) -> str:
    hooks = [getattr(effect, hook) for hooks in HOOKS.values() for hook in hooks]
    files = [] if loaded is None else [loaded.read_bytes()]
    for function in (effect.make_prior, *filter(None, hooks)):
        try:
            files.append(Path(inspect.getfile(function)).read_bytes())
        except (OSError, TypeError):  # typed into a notebook, or no function
            if loaded is None:
                return secrets.token_hex(32)  # nobody knows whether it has changed
    return hashlib.sha256(b"".join(dict.fromkeys(files))).hexdigest()


def _discover() -> None:
    # the package's path is listed because a list written here, or entry points in the
    # installation, would be a second place to change for every effect
    for module in pkgutil.iter_modules(__path__):
        effect = getattr(importlib.import_module(f"{__name__}.{module.name}"), "EFFECT", None)
        if not (isinstance(effect, Effect) and effect.name == module.name):
            raise ImportError(f"{__name__}.{module.name} must define EFFECT, an Effect of its name")
        # the tests try these: here it would import what makes priors
        _registered[effect.name] = effect


def _load(path: str) -> None:
    """Register the effect that a file defines."""
    try:
        _registered_from(_defined_in(path), Path(path))
    except ValueError as err:
        raise ValueError(f"{OWN_EFFECTS} names {path}: {err}") from err


def _defined_in(path: str) -> Effect:
    """What a file calls EFFECT."""
    spec = spec_from_file_location(Path(path).stem, path)
    if spec is None or spec.loader is None:
        raise ValueError(NO_EFFECT)
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as err:  # of a file that a person wrote: whatever is wrong in it
        raise ValueError(f"{type(err).__name__}: {err}") from err
    if not isinstance(effect := getattr(module, "EFFECT", None), Effect):
        raise ValueError(NO_EFFECT)
    return effect


_discover()
for _path in filter(None, os.environ.get(OWN_EFFECTS, "").split(os.pathsep)):
    _load(_path)
