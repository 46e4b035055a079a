"""The registry of effects. Every module in this folder is one effect, named like its file."""

import importlib
import pkgutil
from collections.abc import Mapping
from types import MappingProxyType

from ..effect import Effect
from ..effect_check import check_effect

_registered: dict[str, Effect] = {}

EFFECTS: Mapping[str, Effect] = MappingProxyType(_registered)
"""Every effect by name: the built-in ones in alphabetical order, then those registered since."""


def register(effect: Effect) -> Effect:
    """Try an effect, add it to `EFFECTS` for the life of this process, and return it.

    Worker processes start afresh: an effect from outside has to be registered there as well,
    for instance by the module that defines what they run.

    Raises:
        ValueError: it is no `Effect`, its name is taken, or its prior or a hook breaks the rules
            (`effect_check`). A rheology is tried when a scene is first compiled with it.
    """
    if not isinstance(effect, Effect):
        raise ValueError(f"register wants a models.Effect, got {effect!r}")
    if effect.name in _registered:
        raise ValueError(
            f"there is already an effect {effect.name!r} ({_registered[effect.name].text}); "
            "choose another name"
        )
    check_effect(effect)
    _registered[effect.name] = effect
    return effect


def _discover() -> None:
    # the package's path is listed because a list written here, or entry points in the
    # installation, would be a second place to change for every effect
    for module in pkgutil.iter_modules(__path__):
        effect = getattr(importlib.import_module(f"{__name__}.{module.name}"), "EFFECT", None)
        if not (isinstance(effect, Effect) and effect.name == module.name):
            raise ImportError(f"{__name__}.{module.name} must define EFFECT, an Effect of its name")
        # the tests try these: here it would import what makes priors
        _registered[effect.name] = effect


_discover()
