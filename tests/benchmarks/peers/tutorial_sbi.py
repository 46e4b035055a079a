"""What sbi's NPE gives on the tutorial of the guide's page `sbi`; runs in sbi's own environment:

.venv-peers/sbi/bin/python tests/benchmarks/peers/tutorial_sbi.py
"""

import os
import tempfile

import torch
from sbi.inference import NPE
from sbi.utils import BoxUniform


def main():
    torch.set_num_threads(1)
    os.chdir(tempfile.mkdtemp())  # where sbi leaves its logs
    prior = BoxUniform(-2 * torch.ones(3), 2 * torch.ones(3))
    for n in (60, 1000):
        for seed in range(3):
            torch.manual_seed(seed)
            theta = prior.sample((n,))
            inference = NPE(prior, show_progress_bars=False)
            inference.append_simulations(theta, 1.0 + theta + 0.1 * torch.randn_like(theta)).train()
            posterior = inference.build_posterior()
            draws = posterior.sample((4000,), x=torch.ones(3), show_progress_bars=False)
            print(n, seed, draws.mean(0).numpy().round(3), draws.std(0).numpy().round(3))


if __name__ == "__main__":
    main()
