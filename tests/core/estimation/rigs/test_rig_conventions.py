"""How far a rig file may be off."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.rigs.rig_poses import InitialExtrinsics, require_usual_rig
from lightpen.messages import Message
from lightpen.model.rigid import Rig, rotation_from_vector

RIG = from_first(row_of_cameras(3, 1000.0))


def placed(R: FloatArray, t: FloatArray, rig: Rig = RIG) -> Rig:
    """Return the rig with its third camera elsewhere."""
    rotations, translations = rig.rotations.copy(), rig.translations.copy()
    rotations[2], translations[2] = R, t
    return replace(rig, rotations=rotations, translations=translations)


def turn(degrees: float) -> FloatArray:
    return rotation_from_vector(np.radians([0.0, 0.0, degrees]))


def fault_of(stated: Rig, true: Rig = RIG) -> Message | None:
    """Return what is found fault with; None if the file passes."""
    found = InitialExtrinsics(true, (), np.zeros((0, 3), bool))
    try:
        require_usual_rig(stated, found)
    except CalibrationError as error:
        return error.message
    return None


R2, T2 = RIG.rotations[2], RIG.translations[2]


@pytest.mark.parametrize(("degrees", "passes"), [(14.9, True), (15.1, False)])
def test_a_camera_that_is_turned_by_fifteen_degrees_is_of_another_rig(
    degrees: float, passes: bool
) -> None:
    fault = fault_of(placed(turn(degrees) @ R2, T2))

    assert (fault is None) == passes
    if fault is not None:
        assert fault.code == "rig.of-others"
        assert fault.values["camera"] == RIG.names[2]
        assert fault.values["angle"] == pytest.approx(degrees)
        assert fault.values["distance"] == pytest.approx(0.0)


@pytest.mark.parametrize("distance", [1500.0, 40.0])
@pytest.mark.parametrize(("share", "passes"), [(0.29, True), (0.31, False)])
def test_a_camera_that_is_off_by_a_third_of_its_distance_is_of_another_rig(
    distance: float, share: float, passes: bool
) -> None:
    """Of a camera nearer than 100 mm to the first, of that."""
    true = placed(R2, distance * np.array([0.0, 0.6, 0.8]))
    off = share * max(distance, 100.0)
    fault = fault_of(placed(R2, true.translations[2] + [off, 0, 0]), true)

    assert (fault is None) == passes
    if fault is not None:
        assert fault.code == "rig.of-others"
        assert fault.values["distance"] == pytest.approx(off)
