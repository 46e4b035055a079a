"""What to worry about before a run's pour is trusted, in plain sentences."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..pouring.spillage import ACTION
from . import criticism_sentences, sentences

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

SEARCHED = 3  # simulations that the engine chose, of which fewer are no search
MUCH = 0.05  # spilled, which a person would mop up
KEPT = 0.2  # by the source; what flows has left it then, and a gel leaves less than this
STALE = (
    "The pour was chosen over another posterior than that of the latest calibration or criticism:"
    " choose it again."
)
EDGE = {
    ("angular_velocity", 0): "the slowest",
    ("angular_velocity", 1): "the fastest",
    ("distance", 0): "the nearest",
    ("distance", 1): "the farthest",
}


def worries(
    calibrated: Mapping[str, Any],
    criticised: Mapping[str, Any] | None,
    poured: Mapping[str, Any] | None,
    tree: "DataTree | None",
    posterior: "Dataset",
    searched: int,
) -> list[str]:
    """Sentences, the gravest first; none if nothing is known to be wrong.

    Args:
        calibrated, criticised, poured: Sections of summary.json; None where there is none.
        tree: pour.nc.
        posterior: Draws of the latest calibration.
        searched: Simulations at points that were chosen by what was learned.
    """
    told = [
        sentences.sampler_sentence(calibrated),
        *sentences.emulator_sentences(calibrated),
        _search_sentence(calibrated, searched),
        "" if tree is None or poured_of(tree, posterior) else STALE,
        *_of_the_model(calibrated, criticised),
        sentences.floor_sentence(calibrated),
        *_of_the_pour(poured, tree),
    ]
    return [sentence for sentence in told if sentence]


def _search_sentence(calibrated: Mapping[str, Any], searched: int) -> str:
    if searched >= SEARCHED:
        return ""
    return (
        f"Of {calibrated['n_simulations']} simulations only {searched} went where the liquid may"
        " be: calibrate with a larger --budget before relying on the posterior."
    )


def poured_of(tree: "DataTree", posterior: "Dataset") -> bool:
    """Whether a pour was chosen over draws of this posterior."""
    liquids = tree["liquids"].to_dataset()
    if set(liquids.data_vars) != set(posterior.data_vars):
        return False
    return all(np.isin(liquids[name], posterior[name]).all() for name in liquids.data_vars)


def _of_the_model(calibrated: Mapping[str, Any], criticised: Mapping[str, Any] | None) -> list[str]:
    if criticised is None:
        if calibrated["fit_rms_deg"] > sentences.AS_GOOD_AS_NOISE * calibrated["noise_deg"]:
            return [
                "The closest hypothesis is farther from the recording than noise explains, and the "
                "fit was not criticised: which effect the simulator lacks is not known."
            ]
        return ["The fit was not criticised: whether the simulator lacks an effect is not known."]
    told = []
    if criticised["verdict"] != "none" and not criticised["accepted"]:
        told.append(criticism_sentences.verdict_sentence(criticised))
    if not criticised["baseline"]:
        told.append(criticism_sentences.NO_BASELINE)
    return told


def _of_the_pour(poured: Mapping[str, Any] | None, tree: "DataTree | None") -> list[str]:
    if poured is None or tree is None:
        return []
    told = [_edge_sentence(tree)]
    if poured["expected_spillage"] > MUCH:
        share = sentences.percent(poured["expected_spillage"])
        told.append(
            f"Even the best pour is expected to spill {share}: stir longer, or bring the cups"
            " nearer to each other."
        )
    retained = float(tree["chosen"].to_dataset()["retained"].mean())
    if retained > KEPT:
        told.append(
            f"Of the liquid {sentences.percent(retained)} stays in the source, and what stays is "
            "not spilled: is the final angle of the cups' file large, and held long, enough?"
        )
    return told


def _edge_sentence(tree: "DataTree") -> str:
    """That the chosen pour is at an end of what was allowed, where a better one may be beyond."""
    actions, chosen = tree["actions"], tree["chosen"].attrs
    ends = [
        EDGE[name, end]
        for name in ACTION
        for end, limit in enumerate(actions[name].to_numpy()[[0, -1]])
        if np.isclose(chosen[name], limit)
    ]
    if not ends:
        return ""
    return (
        f"The chosen pour is {' and '.join(ends)} that the cups' file allows; a better one may lie "
        "beyond."
    )
