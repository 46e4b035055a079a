"""What leave-one-out errors, foretold errors and the noise say against an emulator."""

import lazy_loader
import numpy as np

from .held_back import Foretold

stats = lazy_loader.load("scipy.stats", suppress_warning=True)  # takes as long as NumPyro

FALSE_ALARMS = 1e-3  # of each leave-one-out check, were its errors independent and normal
SURPRISES = 1e-2  # nominal share of good fits that are warned, see `surprised`
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
NOISY = (0.9, 0.5)  # shares of run-to-run noise in the variance that deserve a word


class EmulatorWarning(UserWarning):
    """The surrogate does not follow the simulations as it believes; the message says how."""


def complaints(loo_z: np.ndarray, what: str) -> list[str]:
    """Sentences, none where all is well; of usual complaints the same in every fit, so that a
    study of hundreds is warned once.

    Args:
        loo_z: Studentised leave-one-out errors [n, k].
        what: Is emulated.
    """
    count = loo_z.size
    said = []
    far = int(np.sum(np.abs(loo_z) > FAR))
    if far > stats.binom.isf(FALSE_ALARMS, count, 2.0 * stats.norm.sf(FAR)):
        said.append(
            f"{far} of {count} leave-one-out errors of the {what} exceed {FAR:g} standard "
            "deviations: it is not Gaussian, or changes faster than the emulator believes; "
            "simulate more, or choose a summary or transform that behaves better"
        )
    if _too_large(loo_z, TOO_SURE):
        said.append(
            f"leave-one-out errors of the {what} are {np.sqrt(np.mean(loo_z**2)):.1f} times what "
            "the emulator believes; simulate more"
        )
    return said


def surprised(foretold: Foretold) -> list[str]:
    """A sentence where the foretold errors are too large, else none.

    All components of a run go wrong together where the emulator does, and its hyperparameters come
    from few runs. So a run counts as one error, their mean square over the components, and the
    mean of q runs is held against Fisher's F of q and the first runs' degrees of freedom. That is
    no theorem: outputs smooth on the scale of the box hardly ever alarm (tests), those that turn
    within half of it more often than SURPRISES, for few runs show their length scales. What lies
    beyond the components is judged likewise. Small failures of the emulator pass unseen.
    """
    seen = np.isfinite(foretold.errors[:, -1])
    if not seen.any():
        return []
    scores, beyond = foretold.errors[seen, :-1], foretold.errors[seen, -1]
    scores = scores[:, np.isfinite(scores).all(0)]
    limit = stats.f.isf(SURPRISES / 2.0, len(beyond), foretold.freedom)
    if max(np.mean(part**2) for part in (scores, beyond) if part.size) <= limit:
        return []
    return [
        "the last third of the simulations came out further from what the others had led to "
        "expect than the emulator believed possible: the output changes faster with the parameters "
        "than so few simulations show, and the posterior may be too narrow; simulate more"
    ]


def noisy(share: float) -> list[str]:
    """A sentence where run-to-run noise has that much of the outputs' variance, else none."""
    reached = [least for least in NOISY if share > least]
    if not reached:
        return []
    return [
        f"run-to-run noise makes up more than {reached[0]:.0%} of the output's variance "
        "between simulations, and the likelihood takes it as Gaussian and equal for all "
        "parameters; where it is not, as with noise that accumulates, the posterior is off: "
        "compare the other surrogate, or choose a summary that averages the noise out"
    ]


def _too_large(errors: np.ndarray, matters: float) -> bool:
    """Whether studentised errors are, in the mean square, by more than chance."""
    count = errors.size
    return bool(np.mean(errors**2) > max(matters, stats.chi2.isf(FALSE_ALARMS, count) / count))
