"""Guidance: the next posture is the one that helps most."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.estimation.contact.joint import ContactModel, fit_contact
from lightpen.model.coverage import TILT_RINGS
from lightpen.model.rigid import (
    Posture,
    Rig,
    angles_between,
    rig_of,
    rotation_from_vector,
    rotations_of,
    vector_from_rotation,
)
from lightpen.swing.capture.guidance import (
    TILTS,
    TURNS,
    GuidanceInput,
    image_information,
    next_posture,
    usable_leds,
    visible_fields,
)
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
SIGMA = 0.05
SPACING = np.radians(2.5)
PRIOR = np.diag([3.0**-2] * 3 + [1e-8] * 3)


def rotation(tilt: float, direction: float, turn: float = 0.0) -> FloatArray:
    """Return the rotation of a posture in degrees."""
    angles = np.radians([[tilt], [direction], [turn]])
    return np.asarray(rotations_of(PEN, *angles)[0])


def outlook(rotations: FloatArray) -> GuidanceInput:
    """Return what images of these postures leave to be known."""
    blind = GuidanceInput(
        rig_of(CAMERA), PEN, PAPER_TIP, PAPER_CONE, PRIOR, SIGMA, rotations, SPACING
    )
    known = image_information(blind, rotations).sum(axis=0)
    return replace(blind, information=PRIOR + known)


def swung(*degrees: tuple[float, float, float]) -> GuidanceInput:
    return outlook(np.array([rotation(*posture) for posture in degrees]))


def test_the_predicted_information_is_that_of_the_image_taken_there() -> None:
    truth = swing_poses(40, np.random.default_rng(0))
    pixels = simulate_centers(
        *(CAMERA, PEN, truth.rotations, truth.translations),
        SIGMA,
        np.random.default_rng(1),
    )
    joint = fit_contact(
        ContactModel.of(CAMERA, PEN, pixels),
        truth.rotations,
        truth.tip_pen,
        truth.cone_cam,
    )
    joint_outlook = replace(
        outlook(truth.rotations),
        tip_pen=joint.tip_pen,
        cone_cam=joint.cone_cam,
        sigma=joint.sigma,
    )
    predicted = image_information(joint_outlook, joint.rotations)
    full = joint.used.all(axis=1)
    np.testing.assert_allclose(predicted[full], joint.information[full], rtol=1e-9)
    assert full.sum() > 30


def test_after_leaning_to_one_side_the_pen_is_sent_to_another() -> None:
    for direction in (0.0, 90.0, 180.0, 270.0):
        postures = product(
            (5.0, 10.0, 15.0, 20.0, 25.0), (direction,), (-20.0, 0.0, 20.0)
        )
        known = swung(*postures)
        target = next_posture(known, rotation(0, 0))
        assert target is not None
        away = np.cos(target.direction - np.radians(direction))
        assert target.tilt * away < np.radians(5)


def test_no_posture_would_have_shrunk_the_variance_more() -> None:
    known = swung(*product((0.0, 12.0, 24.0), (0.0, 90.0), (-10.0, 15.0)))
    present = rotation(0, 0)
    target = next_posture(known, present)
    assert target is not None

    def variance_after(there: Posture) -> float:
        end = rotations_of(
            PEN,
            np.array([there.tilt]),
            np.array([there.direction]),
            np.array([there.turn]),
        )[0]
        vector = vector_from_rotation(end @ present.T)
        n_images = max(round(float(np.linalg.norm(vector)) / SPACING), 1)
        shares = (np.arange(n_images) + 1) / n_images
        steps = rotation_from_vector(shares[:, None] * vector) @ present
        new = angles_between(steps, known.rotations).min(axis=1) >= SPACING
        information = known.information + image_information(known, steps[new]).sum(
            axis=0
        )
        before = np.trace(np.linalg.inv(known.information)[:3, :3])
        after = np.trace(np.linalg.inv(information)[:3, :3])
        return float((before - after) / n_images)

    places = [(0.0, 0.0)] + [(t, k * np.pi / 4) for t in TILTS for k in range(8)]
    gains = [
        variance_after(Posture(*place, turn)) for place in places for turn in TURNS
    ]
    # The choice looks at three images of each way, this test at all of them.
    assert variance_after(target) > 0.9 * max(gains)


def test_only_wanted_fields_are_chosen() -> None:
    known = swung(*product((0.0, 25.0), (0.0, 90.0, 180.0, 270.0), (0.0, 20.0)))
    wanted = np.zeros((3, 8), dtype=bool)
    wanted[1, 3] = True
    target = next_posture(known, rotation(0, 0), wanted)
    assert target is not None
    assert (target.tilt, target.direction) == (TILTS[0], 3 * np.pi / 4)
    assert next_posture(known, rotation(0, 0), np.zeros((3, 8), dtype=bool)) is None


def test_what_a_second_camera_would_see_counts() -> None:
    alone = swung((0, 0, 0), (20, 0, 0), (20, 120, 0))
    rotations = alone.rotations
    beside = Rig((CAMERA, CAMERA), np.stack([np.eye(3)] * 2), np.zeros((2, 3)))
    both = replace(alone, rig=beside)

    np.testing.assert_allclose(
        image_information(both, rotations), 2 * image_information(alone, rotations)
    )


def test_postures_the_camera_cannot_see_are_left_out() -> None:
    known = swung((10.0, 0.0, 0.0), (10.0, 90.0, 0.0))
    assert visible_fields(known)[1:].all()

    # The cone near the right border: leaning far to the right leaves the image.
    aside = replace(known, cone_cam=PAPER_CONE + np.array([230.0, 0.0, 0.0]))
    fields = visible_fields(aside)
    assert not fields[2, 0]
    assert fields[2, 4]
    target = next_posture(aside, rotation(0, 0))
    assert target is not None
    assert np.cos(target.direction) < 0.8 or target.tilt < TILTS[1]

    # Another camera that far to the right sees what the first does not.
    away = np.array([[0.0, 0.0, 0.0], [-230.0, 0.0, 0.0]])
    beside = Rig((CAMERA, CAMERA), np.stack([np.eye(3)] * 2), away)
    assert visible_fields(replace(aside, rig=beside))[1:].all()

    behind = replace(known, pen=replace(PEN, normals=-PEN.normals))
    turned = rotations_of(PEN, np.zeros(1), np.zeros(1), np.zeros(1))
    assert not usable_leds(behind, turned).any()


@pytest.mark.parametrize(("axis", "sign"), [(0, 1), (0, -1), (1, 1), (1, -1)])
def test_leds_cut_by_the_border_are_not_counted_on(axis: int, sign: int) -> None:
    known = swung((0.0, 0.0, 0.0))
    leds = PEN.leds @ known.rotations[0].T - known.rotations[0] @ PAPER_TIP + PAPER_CONE
    pixels, size = CAMERA.project(leds), (CAMERA.width, CAMERA.height)[axis]
    outermost = int(np.argmax(sign * pixels[:, axis]))
    radius = CAMERA.fx * PEN.diameter / 2 / leds[outermost, 2]
    border = size - 0.5 if sign > 0 else -0.5
    usable = []
    for room in (0.5 * radius, 1.5 * radius):
        shift = np.zeros(2)
        shift[axis] = border - sign * room - pixels[outermost, axis]
        moved = replace(CAMERA, cx=CAMERA.cx + shift[0], cy=CAMERA.cy + shift[1])
        usable.append(
            usable_leds(replace(known, rig=rig_of(moved)), known.rotations)[0]
        )

    assert not usable[0][outermost]
    assert usable[1].all()


@pytest.mark.parametrize(("turn", "counted_on"), [(60.0, True), (80.0, False)])
def test_leds_seen_too_flat_are_not_counted_on(turn: float, counted_on: bool) -> None:
    alone = replace(PEN, leds=PEN.leds[:1], normals=PEN.normals[:1])
    known = replace(swung((0.0, 0.0, turn)), pen=alone)
    assert usable_leds(known, known.rotations)[0, 0] == counted_on


def test_a_way_of_which_there_are_images_already_is_worth_nothing() -> None:
    known, present = swung((10.0, 90.0, 20.0)), rotation(0, 0)
    first = next_posture(known, present)
    assert first is not None
    there = rotation(*np.degrees([first.tilt, first.direction, first.turn]))
    vector = vector_from_rotation(there @ present.T)
    steps = rotation_from_vector(np.linspace(0, 1, 13)[1:, None] * vector) @ present

    taken = replace(known, rotations=np.concatenate([known.rotations, steps]))

    assert next_posture(taken, present) != first


def test_where_all_middles_are_taken_a_posture_beside_one_is_chosen() -> None:
    tilt = np.degrees(TILTS[0])
    known = swung(*((tilt, 90.0, float(turn)) for turn in range(-25, 26)))
    wanted = np.zeros((3, 8), dtype=bool)
    wanted[1, 2] = True

    chosen = next_posture(known, rotation(tilt, 90.0), wanted)

    assert chosen is not None
    there = rotation(*np.degrees([chosen.tilt, chosen.direction, chosen.turn]))
    assert angles_between(there[None], known.rotations).min() > SPACING
    assert TILT_RINGS[0] < chosen.tilt < TILT_RINGS[1]
    assert abs(chosen.direction - np.pi / 2) < np.pi / 8


def test_leds_that_touch_in_the_image_are_not_counted_on() -> None:
    close = PEN.leds.copy()
    close[1] = close[0] + [0, 10.5, 0]
    known = replace(swung((0.0, 0.0, 0.0)), pen=replace(PEN, leds=close))
    usable = usable_leds(known, known.rotations)[0]
    assert not usable[:2].any()
    assert usable[2:].all()
