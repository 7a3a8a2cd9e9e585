"""Postures: the three numbers, there and back."""

from dataclasses import replace

import numpy as np

from lightpen.model.coverage import measure_coverage
from lightpen.model.rigid import (
    Posture,
    angles_between,
    posture_of,
    rotation_from_vector,
    rotations_of,
)
from lightpen_extensions.simulator.swings import paper_pen, random_postures

PEN = paper_pen()
POSTURES = random_postures(50, np.random.default_rng(0))


def test_the_rotations_are_those_of_the_simulated_hand() -> None:
    R = rotations_of(PEN, POSTURES.tilts, POSTURES.directions, POSTURES.rolls)
    np.testing.assert_allclose(R, POSTURES.rotations, atol=1e-15)


def test_a_rotation_gives_its_posture_back() -> None:
    for i, rotation in enumerate(POSTURES.rotations):
        posture = posture_of(PEN, rotation)
        np.testing.assert_allclose(
            [posture.tilt, posture.direction, posture.turn],
            [POSTURES.tilts[i], POSTURES.directions[i], POSTURES.rolls[i]],
            atol=1e-12,
        )


def test_tilt_and_direction_are_those_of_the_coverage() -> None:
    coverage = measure_coverage(POSTURES.rotations)
    found = [posture_of(PEN, rotation) for rotation in POSTURES.rotations]
    np.testing.assert_allclose([p.tilt for p in found], coverage.tilts, atol=1e-7)
    np.testing.assert_allclose([p.direction for p in found], coverage.directions)


def test_leds_that_face_along_x_turn_the_pen_to_the_camera() -> None:
    sideways = replace(PEN, normals=np.tile([1.0, 0.0, 0.0], (PEN.n_leds, 1)))
    R = rotations_of(sideways, np.zeros(1), np.zeros(1), np.zeros(1))[0]

    np.testing.assert_allclose(R @ [1.0, 0, 0], [0, 0, -1], atol=1e-15)
    np.testing.assert_allclose(R @ [0, 1.0, 0], [0, -1, 0], atol=1e-15)
    assert posture_of(sideways, R) == Posture(0.0, 0.0, 0.0)


def test_angles_between_rotations_are_those_they_were_turned_by() -> None:
    angles = np.array([0.0, 0.1, 1.0, 3.0])
    turns = rotation_from_vector(np.outer(angles, [0.6, 0.0, 0.8]))
    found = angles_between(POSTURES.rotations[:1], turns @ POSTURES.rotations[0])
    # The cosine is flat at 0: rounding of 1e-16 becomes an angle of 1e-8.
    np.testing.assert_allclose(found[0], angles, atol=5e-8)
