"""Stirs that could be made next: within what cup, arm and rig allow, and carried out as planned."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from bolfi_liquids.hardware import RigError, bundled_rig
from bolfi_liquids.hardware.motion import Trajectory, joined
from bolfi_liquids.inference.criticism import KnownNoise
from scipy.spatial import cKDTree

import bolfi_liquids as bl
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.rigs import rig_of
from bolfi_liquids.motions import (
    ACCELERATION,
    FILE,
    MAX_SPEED,
    family,
    keep_motion,
    planned,
    stir_proposals,
)
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
    narrow = replace(stirring, recordings=(replace(recording, gripper=gripper),))
    motions = family(narrow, COUNT)
    assert len(motions) == COUNT == len({motion.label for motion in motions})
    away = np.linalg.norm(gripper.position[:, :2], axis=1).max()
    for motion in motions:
        path = motion.path
        assert np.linalg.norm(path.position[:, :2], axis=1).max() < away + 1e-3
        step = np.linalg.norm(np.diff(path.position, axis=0), axis=1) / np.diff(path.time)
        assert step.max() <= MAX_SPEED + 1e-3 and motion.acceleration == ACCELERATION
        # a star or a line is as wide as its file says
        assert np.linalg.norm(path.position[:, :2], axis=1).max() <= motion.radius + 1e-9


def test_each_motion_is_a_file_that_the_bundled_rig_carries_out(stirring, tmp_path):
    """The planned path is the simulated one, but for the rests."""
    for motion in family(stirring, COUNT):
        keep_motion(tmp_path, asdict(motion))
        rig = rig_of(None, tmp_path / FILE)
        assert rig.stirring.clear_height == bundled_rig().stirring.clear_height
        position = joined(list(plan_stir(rig).strokes)).pose[:, :3]
        simulated = motion.path.position
        for one, other in ((position, simulated), (simulated, position)):
            apart, _ = cKDTree(one).query(other)
            assert apart.max() < 0.5 * motion.speed / 30.0 + 1e-4
    keep_motion(tmp_path, None)
    assert not (tmp_path / FILE).exists()


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("speed = 0.16", "speed"),
        ("radius = 0.038", "radius"),
        ("points = 4", "points"),
        ("sped = 0.1", "sped"),
    ],
)
def test_a_motion_that_the_rig_does_not_allow_is_refused_by_its_field(tmp_path, text, field):
    path = tmp_path / "motion.toml"
    path.write_text(text)
    with pytest.raises(RigError) as caught:
        rig_of(None, path)
    assert caught.value.where == f"{path}: stirring.{field}"


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
        assert 0.5 * setup.submerged < plan.submerged <= setup.submerged + 1e-3
        assert proposal.shape == (len(motion.path.time), 2)
        assert proposal.cost == motion.path.time[-1]
