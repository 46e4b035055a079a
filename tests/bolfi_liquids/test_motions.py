"""Stirs that could be made next: within what cup, arm and rig allow, and carried out as planned."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from bolfi_liquids.hardware import RigError, bundled_rig
from bolfi_liquids.hardware.motion import Trajectory, joined
from bolfi_liquids.hardware.rig import MAX_CYCLES, MOTION_FIELDS
from bolfi_liquids.inference.criticism import KnownNoise
from scipy.spatial import cKDTree

import bolfi_liquids as bl
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.rigs import rig_of
from bolfi_liquids.motions import (
    ACCELERATION,
    FILE,
    MAX_SPEED,
    REST,
    family,
    keep_motion,
    planned,
    stir_proposals,
)
from bolfi_liquids.robot.record import dry_stir
from bolfi_liquids.robot.stir import plan_stir
from bolfi_liquids.simulators import stir_simulator

COUNT = 8


@pytest.fixture(scope="module")
def stirring():
    """Of a bundled recording."""
    return stir_simulator([bl.open_recording(bundled_recording("oil").path)], 200)


@pytest.mark.parametrize("factor", [1.0, 0.2])
def test_motions_go_no_farther_than_the_recording_nor_faster_than_an_arm_may(stirring, factor):
    (recording,), scale = stirring.recordings, np.array([factor, factor, 1.0])
    gripper = Trajectory(recording.time, scale * recording.gripper.position)
    motions = family(on_path(stirring, *gripper), COUNT)
    assert len(motions) == COUNT == len({motion.label for motion in motions})
    away = np.linalg.norm(gripper.position[:, :2], axis=1).max()
    for motion in motions:
        path = motion.path
        assert np.linalg.norm(path.position[:, :2], axis=1).max() < away + 1e-3
        step = np.linalg.norm(np.diff(path.position, axis=0), axis=1) / np.diff(path.time)
        assert step.max() <= MAX_SPEED + 1e-3 and motion.acceleration == ACCELERATION
        # a star or a line is as wide as its file says
        assert np.linalg.norm(path.position[:, :2], axis=1).max() <= motion.radius + 1e-9


def on_path(stirring, time, position):
    """The same liquid and stick, stirred along another path."""
    (recording,) = stirring.recordings
    return replace(
        stirring, recordings=(replace(recording, time=time, gripper=Trajectory(time, position)),)
    )


def as_recorded(time, position):
    return time, position


def narrow(time, position):
    return time, position * (0.1, 0.1, 1.0)


def tripled(time, position, times=3):
    return np.arange(times * len(time)) * (time[1] - time[0]), np.tile(position, (times, 1))


@pytest.mark.parametrize("made", [as_recorded, narrow, tripled])
def test_each_motion_is_a_file_that_the_bundled_rig_carries_out(stirring, tmp_path, made):
    """The planned path is the simulated one, as often, but for the rests."""
    (recording,) = stirring.recordings
    motions = family(on_path(stirring, *made(recording.time, recording.gripper.position)), COUNT)
    assert any(motion.pattern == "circle" for motion in motions)
    for motion in motions:
        keep_motion(tmp_path / FILE, asdict(motion))
        rig = rig_of(None, tmp_path / FILE)
        assert rig.stirring.clear_height == bundled_rig().stirring.clear_height
        stir = joined(list(plan_stir(rig).strokes))
        position = stir.pose[:, :3]
        legs = motion.cycles * (1 if motion.pattern == "circle" else motion.points) + 1
        late = stir.duration - 2.0 * rig.stirring.rest - (motion.path.time[-1] - 2.0 * REST)
        assert abs(late) < 1 / 30 + 2 * legs / rig.robot.rate
        simulated = motion.path.position
        for one, other in ((position, simulated), (simulated, position)):
            apart, _ = cKDTree(one).query(other)
            assert apart.max() < 0.5 * motion.speed / 30.0 + 1e-4
    keep_motion(tmp_path / FILE, None)
    assert not (tmp_path / FILE).exists()


def test_a_motion_is_repeated_no_more_often_than_a_rig_takes(stirring):
    (recording,) = stirring.recordings
    path = tripled(*narrow(recording.time, recording.gripper.position), times=60)
    assert max(one.cycles for one in family(on_path(stirring, *path), COUNT)) == MAX_CYCLES


def test_a_missing_position_changes_no_motion(stirring):
    (recording,) = stirring.recordings
    with_gaps = recording.gripper.position.copy()
    with_gaps[[0, 10], [2, 0]] = np.nan
    gapped = on_path(stirring, recording.time, with_gaps)
    whole, motions = family(stirring, COUNT), family(gapped, COUNT)
    assert [(one.radius, one.height) for one in motions] == [
        (one.radius, one.height) for one in whole
    ]
    assert all(np.isfinite(planned(gapped, one).setups[0].submerged) for one in motions)


def refused(directory, text):
    """A motion file of this text, and the bundled rig's refusal of it."""
    path = directory / "motion.toml"
    path.write_text(text)
    with pytest.raises(RigError) as caught:
        rig_of(None, path)
    return path, caught.value


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("speed = 0.16", "speed"),
        ("radius = 0.038", "radius"),
        ("points = 4", "points"),
    ],
)
def test_a_motion_that_the_rig_does_not_allow_is_refused_by_its_field(tmp_path, text, field):
    path, refusal = refused(tmp_path, text)
    assert refusal.where == f"{path}: stirring.{field}"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("sped = 0.1", "sped"),
        ("clear_height = 0.5", "clear_height"),
        ("[stirring]\nspeed = 0.08", "stirring"),
    ],
)
def test_what_is_no_field_of_a_motion_is_refused_with_those_that_are(tmp_path, text, name):
    path, refusal = refused(tmp_path, text)
    assert refusal.where == f"{path}: {name}"
    assert f"has {', '.join(MOTION_FIELDS)}, at the file's top without a heading" in refusal.fix


def test_a_circle_rests_nowhere_and_a_fault_of_the_rig_is_its_own(tmp_path):
    path = tmp_path / "motion.toml"
    path.write_text("pattern = 'circle'\npause = 0.3")
    with pytest.raises(RigError, match="pause") as caught:
        rig_of(None, path)
    assert caught.value.where.startswith(str(path))
    rig = bundled_rig()
    faulty = rig.model_copy(update={"cup": rig.cup.model_copy(update={"radius": 9.0})})
    with pytest.raises(RigError) as caught:
        rig_of(faulty, path)
    assert caught.value.where == "rig: cup.radius"


def test_the_plan_that_a_person_reads_names_the_motion_s_file(tmp_path):
    path = tmp_path / "motion.toml"
    path.write_text("speed = 0.08")
    assert str(path) in dry_stir(rig_of(None, path), None, tmp_path / "out")[0]
    assert "file" not in dry_stir(bundled_rig(), None, tmp_path / "out")[0]


def test_the_stick_is_as_deep_as_the_pivot_is_high(stirring):
    noise, motions = KnownNoise(0.01), family(stirring, COUNT)
    proposals = stir_proposals(stirring, motions, noise)
    assert [one.label for one in proposals] == [motion.label for motion in motions]
    assert len({one.identity for one in proposals}) == COUNT
    (setup,), (recording,) = stirring.setups, stirring.recordings
    tip = recording.gripper.position[0, 2] - setup.stick.length
    for motion, proposal in zip(motions, proposals, strict=True):
        (plan,) = planned(stirring, motion).setups
        assert plan.cup == setup.cup and plan.particles == setup.particles
        raised = motion.height - setup.stick.length - tip
        assert plan.submerged == pytest.approx(setup.submerged - raised)
        assert 0.5 * setup.submerged < plan.submerged <= setup.submerged + 1e-8
        assert proposal.shape == (len(motion.path.time), 2)
        assert proposal.cost == motion.path.time[-1]
