"""What is poured of a liquid that sticks to its cup, before and after criticism."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from bolfi_liquids.inference.simulations import Compute

from bolfi_liquids.calibration.calibrate import calibrate
from bolfi_liquids.criticism.criticise import criticise
from bolfi_liquids.pouring.choose import choose_pour
from bolfi_liquids.pouring.spillage import surface
from bolfi_liquids.progress import silent
from bolfi_liquids.run.given_pours import GIVEN_POURS
from bolfi_liquids.run.run import Run

from .decisions import executions, spilled_by
from .outcomes import pour_all
from .phases import Phase
from .sticky import Sticky, draw_sticky, poured, recipe, stirred, waxed_cups
from .study_size import Scale


class Stuck(NamedTuple):
    """What was found of a liquid.

    Attributes:
        truth: The liquid.
        spilled: Fractions, by the pour chosen after stirring if it did not stick, by the same
            pour, by the one chosen after criticism, and by the best where all is known.
        named: The effects that criticism named.
    """

    truth: Sticky
    spilled: list[float]
    named: str


def spilled_where_it_sticks(out: Path, runs: Path, scale: Scale, number: int) -> Stuck:
    """Stir a liquid, choose its pour, criticise, choose again, and carry all of it out.

    In this process and without bars, since several liquids are made at once.

    Args:
        out: Where pours are kept.
        runs: Where the run is kept.
        scale: How much is simulated.
        number: Of the liquid.
    """
    cups, seed, particles = waxed_cups(), scale.seed, scale.drawn_particles
    truth = draw_sticky(number, seed)
    folder = runs / f"sticky_{number}_{recipe(cups, particles, seed)}"
    folder.mkdir(parents=True, exist_ok=True)
    recording = stirred(truth, particles, folder / "stir.nc")
    density = recording.number("liquid_density")
    table = poured(truth, density, cups, folder / "pours.csv")
    calibration = calibrate(
        recording,
        out=folder / "run",
        particles=particles,
        seed=seed,
        resume=True,
        progress=False,
    )
    tried = {"iterations": scale.rates, "seed": seed, "force": True, "progress": False}
    # of a study that goes on: before criticism no pour is known
    (calibration.path / GIVEN_POURS).unlink(missing_ok=True)
    before = choose_pour(calibration, cups, **tried)
    given = {"pours": table, "cups": cups, "effects": scale.considered, "seed": seed}
    criticism = criticise(calibration, **given, progress=False)
    after = choose_pour(criticism.calibration, cups, **tried)
    sticks = executions(truth.theta, density, cups, truth.seed)
    flows = executions(truth.liquid, density, cups, truth.seed)
    rehearsed = executions(truth.theta, density, cups, truth.seed, Phase.REHEARSAL)
    rates = np.geomspace(*cups.angular_velocity_range, scale.rates)
    with Run(out, {}).bank() as bank:
        compute = Compute(bank=bank)
        known = surface(pour_all(rehearsed, rates, compute, silent), cups).least("mean")
        actions = [before.chosen.action, after.chosen.action, known]
        spilled = [*spilled_by(flows, actions[:1], compute), *spilled_by(sticks, actions, compute)]
    return Stuck(truth, spilled, ", ".join(criticism.effects))
