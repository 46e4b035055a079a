"""What leave-one-out errors and the noise say against an emulator."""

import numpy as np
from scipy.stats import binom, chi2, norm

FALSE_ALARMS = 1e-3  # of each check, where the emulator is right
FAR = 3.0  # studentised errors beyond are rare
TOO_SURE = 1.5  # mean square of the studentised errors that matters
OUTSIDE = (
    "what was observed lies far outside of what was simulated: compare units, scales and offsets, "
    "or widen the prior; the posterior says little"
)
EQUAL = "all simulations are equal: the data cannot tell parameters apart"
UNPREDICTED = (
    "the parameters predict nothing of what was simulated, as far as so few runs can tell from "
    "chance: simulate more, or choose a summary that averages the noise out; until then the "
    "posterior is the prior"
)
NOISY = (0.9, 0.5, 0.1)  # shares of run-to-run noise in the variance that deserve a word


class EmulatorWarning(UserWarning):
    """The surrogate does not follow the simulations as it believes; the message says how."""


def complaints(loo_z: np.ndarray, noise_share: float, what: str) -> list[str]:
    """Sentences, none where all is well; of usual complaints the same in every fit, so that a
    study of hundreds is warned once.

    Args:
        loo_z: Studentised leave-one-out errors [n, k].
        noise_share: Of the targets' variance.
        what: Is emulated.
    """
    count = loo_z.size
    said = []
    far = int(np.sum(np.abs(loo_z) > FAR))
    if far > binom.isf(FALSE_ALARMS, count, 2.0 * norm.sf(FAR)):
        said.append(
            f"{far} of {count} leave-one-out errors of the {what} exceed {FAR:g} standard "
            "deviations: it is not Gaussian, or changes faster than the emulator believes; "
            "simulate more, or choose a summary or transform that behaves better"
        )
    mean_square = float(np.mean(loo_z**2))
    if mean_square > max(TOO_SURE, chi2.isf(FALSE_ALARMS, count) / count):
        said.append(
            f"leave-one-out errors of the {what} are {np.sqrt(mean_square):.1f} times what the "
            "emulator believes; simulate more"
        )
    reached = [share for share in NOISY if noise_share > share]
    if reached:
        said.append(
            f"run-to-run noise makes up more than {reached[0]:.0%} of the {what}'s variance "
            "between simulations, and the likelihood takes it as Gaussian and equal for all "
            "parameters; where it is not, as with noise that accumulates, the posterior is off: "
            "compare the other surrogate, or choose a summary that averages the noise out"
        )
    return said
