"""An acquisition rule of one's own: simulate where the surrogate knows its output least.

Give it to `inference.fit(..., acquisition=LeastKnown())`, and check one of your own by
`pytest tests/extensions --rule your_module:YourRule`.
"""

from dataclasses import dataclass

import jax
import numpy as np
from bolfi_liquids.inference.surrogates import Surrogate


@dataclass(frozen=True)
class LeastKnown:
    """Largest predicted sd, of points that are likely enough.

    Attributes:
        screened: Random points among which each is chosen.
        share: Of them that are considered, the likeliest.
    """

    screened: int = 512
    share: float = 0.25

    def __call__(self, key: jax.Array, surrogate: Surrogate, n: int) -> np.ndarray:
        """Prior quantiles u [n, d]; each point is fantasized before the next is chosen."""
        rng = np.random.default_rng(np.asarray(jax.random.key_data(key)))
        points: list[np.ndarray] = []
        while len(points) < n:
            u = rng.uniform(size=(self.screened, surrogate.u.shape[1]))
            likely = np.argsort(surrogate.log_likelihood(u))[-int(self.share * self.screened) :]
            _, sd = surrogate.predict(u[likely])
            points.append(u[likely][np.argmax(sd.reshape(len(likely), -1).mean(axis=1))])
            if len(points) < n:
                surrogate = surrogate.fantasize(points[-1][None])
        return np.stack(points)
