"""A fit in one file: what it was made of, from which it is learned again when it is loaded.

The file is a zip archive, as NumPy's `.npz`, of arrays without pickled objects, and of `fit.json`,
which says how the fit was made.
"""

import json
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .arguments import check_kind, checked_mapping, is_table, require
from .describe import describe
from .distributions import from_table, to_table
from .engine_version import ENGINE_VERSION
from .history import History
from .learning import key_words, learned_from, training_data
from .prior import Prior
from .sampling.confirmation import Before
from .simulations.failures import failure_columns, failure_of
from .surrogates.base import Family
from .surrogates.families import FAMILIES, option_names, resolve

SAME = 1e-3  # relative, up to which what is learned again is what was learned
MADE, OPTION = "fit.json", "option_"
SCALARS = bool, int, float, str, type(None)
OF_HISTORY = "theta", "seeds", "rounds", "discrepancy"
# of a file that is none of ours, or damaged
UNREADABLE = (
    *(ValueError, TypeError, AttributeError, KeyError, EOFError, NotImplementedError),
    *(zipfile.BadZipFile, zlib.error),
)


def write_fit(path: str | Path, fit: Any) -> Path:
    """See `Fit.save`; `fit` is one."""
    check_kind("path", path, str | Path)
    history, before, own = fit.history, fit.before, type(fit.family) in FAMILIES.values()
    options = vars(fit.family) if own else {}
    scalars = {name: value for name, value in options.items() if isinstance(value, SCALARS)}
    arrays = {
        OPTION + name: np.asarray(value)
        for name, value in options.items()
        if name not in scalars and _is_array(value)
    }
    arrays |= {name: getattr(history, name) for name in OF_HISTORY}
    outputs = [np.zeros(0) if one is None else np.asarray(one) for one in history.outputs]
    arrays["outputs"] = np.concatenate([one.ravel() for one in outputs])
    arrays |= {"observed": fit.observed, "log_density": _log_density(fit)}
    made: dict[str, Any] = {
        "engine_version": ENGINE_VERSION,
        "prior": _written(fit.prior, history),
        "described_prior": fit.prior.describe(),
        "units": fit.prior.units,
        "own_family": own,
        "options": scalars,
        "settings": dict(fit.settings),
        "seconds": dict(fit.seconds),
        "asked": fit.asked,
        "failures": [failure_columns(one) for one in history.why],
        "shapes": [None if one is None else one.shape for one in history.outputs],
    }
    if before is not None:
        arrays |= {name: getattr(before, name) for name in ("mean", "sd", "drawn")}
        made["before"] = {"told": before.told, "asked": before.asked}
    path = Path(path)
    part = path.with_name(f"{path.name}.part")  # a crash leaves no half of a file
    try:
        with part.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
        with zipfile.ZipFile(part, "a", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(MADE, json.dumps(made, indent=1))
        return part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read_fit(
    path: str | Path, prior: Prior | None, surrogate: Family | None, options: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The fields of a `Fit`, see `Fit.load`, and the arrays of its file."""
    made, arrays = _opened(path)
    prior = _checked_prior(made, prior)
    family = _family(made, arrays, surrogate, options)
    observed, settings = arrays["observed"], made["settings"]
    view = family.view(observed)
    history = _history(made, arrays, prior, family, view)

    def learned(known: History, asked: int) -> Any:
        words = key_words(settings["seed"], asked)
        return learned_from(family, training_data(view, known, prior), words)

    before = None
    if "before" in made:
        told, asked = made["before"]["told"], made["before"]["asked"]
        earlier = learned(history.first(told), asked)
        before = Before(arrays["mean"], arrays["sd"], earlier, told, arrays["drawn"], asked)
    fields = {
        "prior": prior,
        "observed": observed,
        "family": family,
        "history": history,
        "learned": learned(history, made["asked"]),
        "settings": settings,
        "seconds": made["seconds"],
        "before": before,
        "asked": made["asked"],
    }
    return fields, arrays


def _is_array(value: Any) -> bool:
    """Whether an option is numbers; a named tuple is a rule, and a table runs of a simulator."""
    listed = isinstance(value, list | tuple) and not hasattr(value, "_fields")
    listed = listed and not any(map(is_table, value))
    return (listed or hasattr(value, "__array__")) and np.asarray(value).dtype.kind in "biuf"


def check_same(path: str | Path, arrays: Mapping[str, np.ndarray], fit: Any) -> None:
    """Raise ValueError unless a loaded fit concludes what the stored one did."""
    for what, now in (("discrepancy", fit.history.discrepancy), ("log_density", _log_density(fit))):
        if not np.allclose(now, arrays[what], rtol=SAME, atol=SAME, equal_nan=True):
            raise ValueError(
                f"path {str(path)!r} holds a fit whose {what} at its simulations is not what was "
                "learned from them now: give the functions with which it was made"
            )


def _log_density(fit: Any) -> np.ndarray:
    return fit.log_prob(fit.prior.to_dict(fit.history.theta))


def _opened(path: str | Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    check_kind("path", path, str | Path)
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        made = json.loads(arrays.pop(MADE))
        version = made["engine_version"]
    except UNREADABLE as error:
        raise ValueError(f"path must be a file of Fit.save, got {str(path)!r}") from error
    if version != ENGINE_VERSION:
        raise ValueError(
            f"path {str(path)!r} was saved by version {version} of the engine, and this is version "
            f"{ENGINE_VERSION}: load it with the release that saved it, or fit again"
        )
    return made, arrays


def _written(prior: Prior, history: History) -> dict[str, Any] | None:
    """Tables of a prior's distributions; None where they do not give the same bits."""
    try:
        tables = {name: to_table(one) for name, one in prior.distributions.items()}
        again = Prior({name: from_table(one) for name, one in tables.items()})
    except (AttributeError, TypeError, ValueError):
        return None
    theta = prior.to_dict(history.theta)
    pairs = [(again.to_unit(theta), history.u), (again.log_prob(theta), prior.log_prob(theta))]
    pairs += [(again.from_unit(history.u)[n], prior.from_unit(history.u)[n]) for n in prior.names]
    return tables if all(np.array_equal(*pair) for pair in pairs) else None


def _checked_prior(made: Mapping[str, Any], prior: Prior | None) -> Prior:
    if prior is None and made["prior"] is not None:
        tables = made["prior"].items()
        return Prior({name: from_table(one) for name, one in tables}, made["units"])
    if isinstance(prior, Prior) and prior.describe() == made["described_prior"]:
        return prior
    described = {name: of["prior"] for name, of in made["described_prior"].items()}
    raise ValueError(
        f"prior must be {described}, with which the fit was made: give load(path, prior=...), "
        f"got {prior!r:.100}"
    )


def _family(
    made: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray],
    surrogate: Family | None,
    options: Mapping[str, Any],
) -> Family:
    """The family, of what was stored and of what is given again."""
    settings, given = made["settings"], checked_mapping("options", options, "values")
    if surrogate is None:
        name = settings["surrogate"]
        cure = "give load(path, surrogate=...) the one with which the fit was made"
        require(made["own_family"], "surrogate", f"be {name!r}", surrogate, cure=cure)
        # a number of NumPy is one again, and no array
        held = {n.removeprefix(OPTION): v[()] for n, v in arrays.items() if n.startswith(OPTION)}
        stored = {**made["options"], **held}
        for missing in sorted(option_names(name) - {*stored, *given}):
            cure = f"give load(path, {missing}=...) what the fit was made with"
            require(False, missing, f"be {settings[missing]}", None, cure=cure)
        family, looked_at = resolve(name, {**stored, **given}), given
    else:
        family = resolve(surrogate, given)
        looked_at, name = vars(family), family.name or type(family).__name__
        due = f"be {settings['surrogate']!r}, as stored"
        require(name == settings["surrogate"], "surrogate", due, name)
    for name in looked_at:
        got = describe(vars(family)[name])
        require(got == settings.get(name), name, f"be {settings.get(name)}, as stored", got)
    return family


def _history(
    made: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray],
    prior: Prior,
    family: Family,
    view: Any,
) -> History:
    sizes = [0 if shape is None else int(np.prod(shape)) for shape in made["shapes"]]
    flat = arrays["outputs"]
    flat.flags.writeable = False
    parts = np.split(flat, np.cumsum(sizes)[:-1])
    outputs = tuple(
        None if shape is None else part.reshape(shape)
        for part, shape in zip(parts, made["shapes"], strict=True)
    )
    measured, why = family.measure(view, outputs), np.full(len(outputs), None)
    why[:] = [failure_of(kind, text or "") for kind, text in made["failures"]]
    return History(
        theta=arrays["theta"],
        u=prior.to_unit(prior.to_dict(arrays["theta"])),
        outputs=outputs,
        features=measured.features,
        discrepancy=measured.discrepancy,
        seeds=arrays["seeds"],
        rounds=arrays["rounds"],
        why=why,
        observed_shape=arrays["observed"].shape,
    )
