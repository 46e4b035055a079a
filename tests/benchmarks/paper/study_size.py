"""How much of everything is simulated."""

from dataclasses import dataclass

from bolfi_liquids.inputs.settings import PRIOR_POURS


@dataclass(frozen=True)
class Scale:
    """Of all figures.

    Attributes:
        repetitions: Truths of each liquid.
        budgets: Simulations to learn from, ascending.
        recorded: Simulations for each recording of the reference solver.
        strokes: Numbers of strokes to calibrate after.
        few: Budget of each calibration after some strokes.
        rates: Angular velocities among which pours after a recording are chosen.
        surrogates: Surrogates that recordings are calibrated with.
        lips: Heights of the lip that are compared [m].
        particles: Of the stirs by which bundled recordings are calibrated; 0: cells follow the
            stick.
        drawn_particles: Of the stirs of drawn truths, and of those by which they are calibrated.
        pours: Of the map by which actions are chosen.
        seed: Seed of all random draws.
    """

    repetitions: int = 5
    budgets: tuple[int, ...] = (5, 10, 20, 40, 60)
    recorded: tuple[int, ...] = (10, 20)
    strokes: tuple[int, ...] = (1, 2, 3, 5, 10)
    few: int = 10
    rates: int = 15
    surrogates: tuple[str, ...] = ("discrepancy", "signal")
    lips: tuple[float, ...] = (0.10, 0.14, 0.20, 0.26)
    particles: int = 0
    drawn_particles: int = 0
    pours: int = PRIOR_POURS
    seed: int = 0


FULL = Scale()
QUICK = Scale(
    repetitions=2,
    budgets=(5, 10, 20),
    recorded=(10,),
    strokes=(1, 3, 10),
    rates=9,
    surrogates=("discrepancy",),
    lips=(0.14, 0.20),
    pours=PRIOR_POURS // 2,
)
