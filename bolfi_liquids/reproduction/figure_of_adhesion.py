"""What a liquid's sticking to its cup costs, and what criticism wins back."""

import numpy as np
from numpy.typing import NDArray

from ..calibrator import calibrate
from ..criticiser import criticise
from ..cups import bundled_cups
from ..drawing import BLUE, GREY, ORANGE, PALETTE, new_figure, styled
from ..pouring import Pour, choose_pour
from ..spillage import Outcomes, pour_all, surface
from .decisions import Action, executions, spilled_by
from .figure import Drawn
from .sticky import TRAINING, Sticky, draw_sticky, poured, recipe, stirred
from .workshop import Workshop

_REHEARSAL = 73  # purpose of seeds

CASES = {
    "believed": ("the same pour if it did not stick", GREY),
    "before": ("chosen after stirring", ORANGE),
    "after": (f"chosen after stirring, {len(TRAINING)} pours and criticism", BLUE),
    "known": ("liquid and adhesion known", PALETTE[2]),
}


def adhesion(workshop: Workshop) -> Drawn:
    """Spilled by liquids like glycerin that stick to their cup."""
    from xarray import Dataset

    numbers = range(workshop.scale.sticky)
    found = [_spilled(workshop, number) for number in numbers]
    truths = [truth for truth, _, _ in found]
    spilled = np.array([values for _, values, _ in found])
    named = [names for _, _, names in found]
    with styled():
        figure = new_figure(6.4, 3.8)
        axes = figure.subplots()
        for place, (label, colour) in enumerate(CASES.values()):
            own = 100.0 * spilled[:, place]
            axes.bar(place, own.mean(), 0.7, color=colour, alpha=0.6, label=label)
            axes.plot(
                place + 0.08 * (np.arange(len(own)) - (len(own) - 1) / 2),
                own,
                ".",
                color=colour,
                ms=6,
            )
        axes.set_xticks([])
        axes.set_ylabel("spilled [%]")
        figure.legend(loc="outside lower center", ncols=2)
    data = Dataset(
        {"spilled": (("truth", "case"), spilled), "named": ("truth", named)},
        {
            "case": list(CASES),
            **{key: ("truth", [truth.theta[key] for truth in truths]) for key in truths[0].theta},
        },
    )
    return Drawn(data, figure, _says(100.0 * spilled.mean(axis=0), named))


def _says(means: NDArray, named: list[str]) -> str:
    believed, before, after, known = means
    right = sum(names == "adhesion" for names in named)
    lost = before - known
    won = f"{100 * (before - after) / lost:.0f} % of the loss won back; " if lost > 0 else ""
    return (
        f"spilled where the liquid sticks: {before:.1f} % by the pour chosen after stirring "
        f"({believed:.1f} % if it did not stick), {after:.1f} % by the one chosen after criticism, "
        f"{known:.1f} % with all known: {won}adhesion named alone in {right} of {len(named)}"
    )


def _spilled(workshop: Workshop, number: int) -> tuple[Sticky, list[float], str]:
    """A truth, what it spilled in each of `CASES`, and the effects that were named."""
    cups, seed, shown = bundled_cups(), workshop.scale.seed, workshop.progress
    truth = draw_sticky(number, seed)
    folder = workshop.runs / f"sticky_{number}_{recipe(cups, workshop.scale.particles, seed)}"
    folder.mkdir(parents=True, exist_ok=True)
    recording = stirred(truth, workshop.scale.particles, folder / "stir.nc")
    density = recording.number("liquid_density")
    table = poured(truth, density, cups, folder / "pours.csv")
    calibration = calibrate(
        recording,
        out=folder / "run",
        particles=workshop.scale.particles,
        seed=seed,
        resume=True,
        progress=shown,
    )
    tried = {"iterations": workshop.scale.rates, "seed": seed, "progress": shown}
    before = choose_pour(calibration, cups, **tried)
    effects = workshop.scale.considered
    criticism = criticise(calibration, pours=table, effects=effects, seed=seed, progress=shown)
    after = choose_pour(criticism.calibration, cups, **tried)
    sticks = executions(truth.theta, density, cups, truth.seed)
    flows = executions(truth.liquid, density, cups, truth.seed)
    rehearsed = executions(truth.theta, density, cups, truth.seed, _REHEARSAL)
    actions = [_action(before), _action(after), _best(workshop, rehearsed)]
    spilled = [
        *spilled_by(flows, actions[:1], workshop.bank),
        *spilled_by(sticks, actions, workshop.bank),
    ]
    return truth, spilled, ", ".join(criticism.effects)


def _action(pour: Pour) -> Action:
    return {
        "angular_velocity": pour.chosen.angular_velocity,
        "distance": pour.chosen.distance,
    }


def _best(workshop: Workshop, outcomes: Outcomes) -> Action:
    """The action of least spillage where everything is known."""
    rates = np.geomspace(*outcomes.cups.angular_velocity_range, workshop.scale.grid.rates)
    return surface(
        pour_all(outcomes, rates, workshop.bank, lambda steps: None), outcomes.cups
    ).least("mean")
