"""How far a rig file may be off, and the words for what it looks like."""

from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.rigs.rig_poses import InitialExtrinsics, require_usual_rig
from lightpen.messages import Message
from lightpen.model.rigid import Rig, from_first, rotation_from_vector
from lightpen_extensions.simulator.scenes import row_of_cameras

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


def parts_of(fault: Message | None) -> list[str]:
    return [] if fault is None else [part.code for part in fault.parts()]


R2, T2 = RIG.rotations[2], RIG.translations[2]


@pytest.mark.parametrize(("degrees", "passes"), [(14.9, True), (15.1, False)])
def test_a_camera_that_is_turned_by_fifteen_degrees_is_of_another_rig(
    degrees: float, passes: bool
) -> None:
    fault = fault_of(placed(turn(degrees) @ R2, T2))

    assert (fault is None) == passes
    if fault is not None:
        assert fault.code == "rig.of-others"
        where = fault.values["where"]
        assert isinstance(where, Message)
        assert where.values["camera"] == RIG.names[2]
        assert where.values["angle"] == pytest.approx(degrees)
        assert where.values["distance"] == pytest.approx(0.0)


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
        where = fault.values["where"]
        assert isinstance(where, Message)
        assert where.values["distance"] == pytest.approx(off)


@pytest.mark.parametrize(("degrees", "passes"), [(2.4, True), (2.6, False)])
def test_a_mistake_is_named_where_it_turns_a_camera_by_more_than_five_degrees(
    degrees: float, passes: bool
) -> None:
    true = replace(RIG, rotations=np.stack([np.eye(3), np.eye(3), turn(degrees)]))
    fault = fault_of(placed(turn(-degrees), T2, true), true)

    assert parts_of(fault)[1:] == (
        [] if passes else ["rig.elsewhere", "rig.transposed"]
    )


@pytest.mark.parametrize(("degrees", "is_named"), [(1.9, True), (2.1, False)])
def test_a_mistake_must_explain_more_than_half_of_what_is_off(
    degrees: float, is_named: bool
) -> None:
    rotations = np.swapaxes(RIG.rotations, 1, 2)
    stated = replace(RIG, rotations=rotations)
    fault = fault_of(placed(rotations[2] @ turn(degrees), T2, stated))

    assert ("rig.transposed" in parts_of(fault)) == is_named


UNITS = {"metres": 1000.0, "inches": 25.4, "centimetres": 10.0, "micrometres": 0.001}


@pytest.mark.parametrize("unit", UNITS)
def test_each_unit_is_named_alone_and_with_each_direction(unit: str) -> None:
    R, t = RIG.rotations, RIG.translations / UNITS[unit]
    backwards = np.swapaxes(R, 1, 2)
    positions = -np.einsum("cji,cj->ci", R, t)
    directions = {
        "rig.inverted": (backwards, positions),
        "rig.transposed": (backwards, t),
        "rig.position": (R, positions),
    }
    alone = parts_of(fault_of(replace(RIG, translations=t)))
    assert alone[-2:] == ["rig.unit", f"unit.{unit}"]
    for code, (rotations, translations) in directions.items():
        stated = replace(RIG, rotations=rotations, translations=translations)
        found = parts_of(fault_of(stated))
        assert {"rig.direction-and-unit", code, f"unit.{unit}"} <= set(found)
        in_mm = replace(stated, translations=UNITS[unit] * translations)
        assert parts_of(fault_of(in_mm))[-1] == code
