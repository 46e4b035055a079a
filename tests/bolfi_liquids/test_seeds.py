"""Seeds of every phase are their own."""

import re
from pathlib import Path

import bolfi_liquids
from bolfi_liquids.seeds import Phase, generator, simulation_seeds

COUNT = 50
APPLICATION = Path(bolfi_liquids.__path__[0])
PARTS = ("hardware", "inference", "models")


def test_seeds_differ_by_run_phase_and_step():
    every = [seed for phase in Phase for seed in simulation_seeds(0, phase, COUNT)]
    every += simulation_seeds(1, Phase.REPLICATES, COUNT)
    every += simulation_seeds(0, Phase.REPLICATES, COUNT, 1)
    # by chance 850 of 2^31 hold two that are equal once in six thousand times
    assert len(set(every)) == len(every)
    assert min(every) >= 0 and max(every) < 2**31


def test_the_first_seeds_do_not_depend_on_their_number():
    few, many = (simulation_seeds(3, Phase.MAP_POURS, count) for count in (5, COUNT))
    assert few == many[:5]


def test_random_numbers_differ_by_phase_and_step():
    drawn = {generator(0, phase).random() for phase in Phase}
    one = Phase.REPLICATES
    drawn |= {generator(0, one, 1, 2).random(), generator(0, one, 12).random()}
    assert len(drawn) == len(Phase) + 2


def test_nothing_else_makes_random_numbers_from_a_seed():
    own = re.compile(r"default_rng|SeedSequence|rng=(?:\d|[\w.]*seed)")
    offenders = [
        path
        for path in APPLICATION.rglob("*.py")
        if path.relative_to(APPLICATION).parts[0] not in (*PARTS, "seeds.py")
        and own.search(path.read_text("utf-8"))
    ]
    assert not offenders
