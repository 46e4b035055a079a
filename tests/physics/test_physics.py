"""Every case of the fluid keeps its tolerances; `make physics` shows the tables."""

from pathlib import Path

import pytest
from cases import (
    camera_effects,
    floating_stick,
    pendulum_in_air,
    pendulum_in_liquid,
    resolution,
    rig_effects,
    seed_noise,
    volume_in_cup,
)
from cup_cases import (
    archimedes,
    column_at_rest,
    herschel_bulkley,
    oscillating_cylinder,
    ring_couette,
    sloshing,
    swirl_decay,
    swirl_poiseuille,
    towed_rod,
    warming_swirl,
)
from results import table, write_figure, write_record
from wet_cases import (
    capillary_rise,
    contact_angle,
    dam_break,
    dewetting,
    falling_stream,
    film_flow,
    meniscus,
    oscillating_drop,
    retained_film,
)

SEED = 0
SHORT = (
    camera_effects,
    capillary_rise,
    contact_angle,
    dam_break,
    dewetting,
    falling_stream,
    film_flow,
    herschel_bulkley,
    meniscus,
    oscillating_drop,
    pendulum_in_air,
    retained_film,
    rig_effects,
    swirl_decay,
    warming_swirl,
)
"""Those that take less than 15 s of processor time."""
LONG = (
    archimedes,
    column_at_rest,
    floating_stick,
    oscillating_cylinder,
    pendulum_in_liquid,
    resolution,
    ring_couette,
    seed_noise,
    sloshing,
    swirl_poiseuille,
    towed_rod,
    volume_in_cup,
)
CASES = {
    module.__name__.rpartition(".")[2]: (module.CASE, mark)
    for modules, mark in ((SHORT, pytest.mark.slow), (LONG, pytest.mark.minutes))
    for module in modules
}


@pytest.mark.parametrize(
    ("name", "case"),
    [pytest.param(name, case, marks=mark, id=name) for name, (case, mark) in CASES.items()],
)
def test_a_case_keeps_its_tolerances(name, case, results_folder):
    result = case.run(SEED)
    unit = f", errors {case.unit}" if case.unit else ""
    print(f"\n{name}: {case.truth} ({case.source}){unit}\n{table(result.rows)}")
    for note, value in result.notes.items():
        print(f"{note}: {value}")
    write_figure(results_folder / f"{name}.svg", result.panels)
    about = {"truth": case.truth, "source": case.source, "unit": case.unit}
    write_record(results_folder / f"{name}.json", "case", {**about, "rows": result.rows})
    missed = [row for row in result.rows if not row.passed]
    assert not missed, f"\n{table(missed)}"


def test_no_case_is_forgotten():
    folders = (Path(__file__).parent / name for name in ("cases", "cup_cases", "wet_cases"))
    assert {path.stem for folder in folders for path in folder.glob("[!_]*.py")} == set(CASES)


def test_a_case_says_what_is_true_and_whence():
    for case, _ in CASES.values():
        assert case.truth and case.source and not case.truth.endswith(".")
