"""What may be poured by an arm, and what a person reads before it is."""

import json
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from bolfi_liquids.hardware import MotionRejected, RigError, bundled_rig
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app
from bolfi_liquids.cli.printed import print_next_pour
from bolfi_liquids.criticism.result import calibration_to_pour
from bolfi_liquids.errors import InputError
from bolfi_liquids.reporting.warnings import Results, warnings_of
from bolfi_liquids.robot.pour import BAD_FIT, chosen_pour, plan_pour
from bolfi_liquids.run.run import Run
from bolfi_liquids.wording import spilled


def rewritten(path, change=lambda tree: None, **made_from):
    """The pour of a run, as if it had been concluded otherwise."""
    run = Run.open(path)
    tree = run.required("pour")
    change(tree)
    held = json.loads(tree.attrs["made_from"]) | made_from
    run.keep("pour", tree, held, json.loads(tree.attrs["summary"]))


def with_action(run, **action):
    """Another action."""
    rewritten(run, lambda tree: tree["chosen"].attrs.update(action))


def chosen_in(path):
    return chosen_pour(Run.open(path))


def refused(*_):
    raise AssertionError("nobody may be asked")


def test_the_action_is_that_of_pour_nc_to_the_last_digit(poured_run):
    chosen = bl.Pour.open(poured_run).chosen
    planned = chosen_in(poured_run)
    assert planned.pour.chosen.action == chosen.action
    (path,) = plan_pour(planned, bundled_rig()).paths
    turned = path.pose[:, 3:]
    assert np.ptp(turned, axis=0).max() > 1.0  # it does pour


def test_a_receiver_that_overlaps_the_stirred_cup_is_refused_with_its_own_radius(poured_run):
    """rig.toml does not say how wide the receiver is; the cups of the pour do."""
    rig, receiver = bundled_rig(), chosen_in(poured_run).cups.receiver
    apart = rig.cup.radius + receiver.radius

    def beside(gap):
        x, y, z = rig.cup.position
        place = {"receiver": (x - apart - gap, y, z)}
        return rig.model_copy(update={"pouring": rig.pouring.model_copy(update=place)})

    with pytest.raises(InputError, match="stands in the stirred cup"):
        plan_pour(chosen_in(poured_run), beside(-0.001))
    with suppress(MotionRejected):  # so near, a pour leaves its box
        plan_pour(chosen_in(poured_run), beside(0.001))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("distance", -0.05),
        ("distance", float("nan")),
        ("angular_velocity", np.radians(181.0)),
    ],
)
def test_an_action_outside_of_what_the_cups_allow_is_refused(poured_run, name, value):
    with_action(poured_run, **{name: value})
    for who in ({"ask": refused}, {"emulate": True}):
        with pytest.raises(InputError) as caught:
            bl.execute_pour(poured_run, **who)
        assert name in str(caught.value)


def test_both_ends_of_what_the_cups_allow_may_be_poured(poured_run):
    cups = chosen_in(poured_run).cups
    ranges = {"distance": cups.distance_range, "angular_velocity": cups.angular_velocity_range}
    for end in (0, 1):
        action = {name: ends[end] for name, ends in ranges.items()}
        with_action(poured_run, **action)
        assert chosen_in(poured_run).pour.chosen.action == action


@pytest.mark.parametrize("made_from", [{"after": "another"}, {"given": "other pours"}])
def test_a_stale_pour_is_never_carried_out(poured_run, made_from):
    assert chosen_in(poured_run)
    rewritten(poured_run, **made_from)
    for who in ({"ask": refused}, {"emulate": True}):
        with pytest.raises(InputError, match=r"pour\.nc was made .*: bolfi-liquids pour"):
            bl.execute_pour(poured_run, **who)


BAD = {"calibrate": {"fit_rms_deg": 2.1, "noise_deg": 0.24}, "pour": {"fit_status": "bad"}}


@pytest.mark.parametrize("step", BAD)
def test_a_pour_over_a_bad_fit_needs_its_own_word(poured_run, with_numbers, step):
    assert not chosen_in(poured_run).fit_is_bad
    with_numbers(poured_run, step, **BAD[step])
    assert chosen_in(poured_run).fit_is_bad
    with pytest.raises(InputError, match="--despite-bad-fit"):
        bl.execute_pour(poured_run, ask=refused)
    plans = []

    def ask(plan):
        plans.append(plan)
        return "no"

    with pytest.raises(RigError, match="confirmation"):
        bl.execute_pour(poured_run, ask=ask, despite_bad_fit=True)
    assert "--despite-bad-fit" in plans[0].splitlines()[0]  # before the pour itself


@pytest.mark.slow
def test_an_emulated_pour_tells_the_plan_and_that_the_fit_is_bad(poured_run, with_numbers):
    with_numbers(poured_run, "pour", **BAD["pour"])
    result = CliRunner().invoke(app, ["pour", str(poured_run), "--execute", "--emulator"])
    assert result.exit_code == 0
    assert BAD_FIT in result.stderr and "expected to spill" in result.stderr


def test_what_follows_a_bad_fit_is_no_pour(poured_run, with_numbers, capsys):
    print_next_pour(calibration_to_pour(Run.open(poured_run)), "criticise")
    assert "bolfi-liquids pour" in capsys.readouterr().out
    with_numbers(poured_run, **BAD["calibrate"])
    print_next_pour(calibration_to_pour(Run.open(poured_run)), "criticise")
    assert "bolfi-liquids pour" not in capsys.readouterr().out


def test_an_arm_refuses_a_pour_over_a_bad_fit_on_the_command_line(poured_run, with_numbers):
    with_numbers(poured_run, "pour", **BAD["pour"])
    execute = ["pour", str(poured_run), "--execute", "--arm"]
    result = CliRunner().invoke(app, execute)
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert "--despite-bad-fit" in line
    result = CliRunner().invoke(app, [*execute, "--despite-bad-fit"])
    assert result.exit_code == 2
    assert "no terminal" in result.stderr  # it has come as far as the question
    result = CliRunner().invoke(app, ["pour", str(poured_run), "--despite-bad-fit"])
    assert result.exit_code == 2 and "--execute" in result.stderr


def test_a_person_reads_the_pour_and_the_warnings_before_the_question(poured_run):
    read = []

    def ask(plan):
        read.append(plan)
        return "no"

    with pytest.raises(RigError, match="confirmation"):
        bl.execute_pour(poured_run, ask=ask)
    (plan,) = read
    chosen = chosen_in(poured_run)
    judged = chosen.pour.chosen
    for text in (
        f"{np.degrees(judged.angular_velocity):.1f} deg/s",
        f"{100 * judged.distance:.2f} cm",
        spilled(judged.expected_spillage),
        f"{spilled(judged.spillage_q95)} in 95 %",
    ):
        assert text in plan.split("allowed")[0]
    told = warnings_of(Results.of(Run.open(poured_run)))
    assert chosen.warnings == tuple(told) and told  # as the report has them
    assert all(str(one) in plan for one in told)
    assert "emergency stop" in plan


def test_a_pour_that_was_replaced_in_its_run_is_refused(poured_run):
    pour = bl.Pour.open(poured_run)
    chosen, plug_in = pour.chosen, pour.plug_in
    others = (
        replace(pour, chosen=replace(chosen, distance=0.0123)),
        replace(pour, chosen=replace(chosen, fractions=chosen.fractions[:, ::-1])),
        replace(pour, plug_in=replace(plug_in, angular_velocity=1.0)),
    )
    for other in others:
        with pytest.raises(ValueError, match="another pour was chosen"):
            bl.execute_pour(other, ask=refused)


def test_what_belongs_to_the_choice_is_not_taken_with_execute(poured_run):
    for option in (["--cups", "other.toml"], ["--iterations", "9"]):
        result = CliRunner().invoke(app, ["pour", str(poured_run), "--execute", *option])
        assert result.exit_code == 2
        assert option[0] in result.stderr and "--execute" in result.stderr
