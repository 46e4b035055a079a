"""What a criticism may conclude, and what may become of an effect."""

from enum import StrEnum


class Verdict(StrEnum):
    """The conclusion of a criticism; equal to its spelling in summary.json."""

    NONE = "none"
    EFFECT = "effect"
    TIE = "tie"
    UNKNOWN = "unknown"

    @property
    def advice(self) -> str:
        """What it means and what to do next."""
        return _ADVICE[self]


_ADVICE = {
    Verdict.NONE: "No missing effect was detected. The SNR of an effect shows whether these data "
    "could have revealed it.",
    Verdict.EFFECT: "The named effect joined the model. Choose the pour from "
    "`criticism.calibration`, and confirm the effect on held-out recordings.",
    Verdict.TIE: "Several effects explain the data equally well. Record the suggested experiment "
    "and criticise again.",
    Verdict.UNKNOWN: "Simulation and data differ and no known effect explains it. Look at "
    "`plot_residuals` and `plot_strokes` for where they differ.",
}


class EffectStatus(StrEnum):
    """What became of an effect as an explanation; its spelling is that in criticism.nc."""

    NAMED = "named"
    POSSIBLE = "possible"
    LESS_LIKELY = "less likely"
    REFUTED = "refuted by held-out data"
    REJECTED = "rejected"
    NOT_NEEDED = "not needed"
    NOT_REFITTED = "untested by a refit"
    FAILED = "untested: its simulations failed"
