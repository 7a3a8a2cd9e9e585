"""The tip in force, with the instrument that its swing and the files make."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from tests.accepted_tip import accept_tip

from lightpen.arrays import FloatArray
from lightpen.errors import UsageError
from lightpen.formats.opened_files import CameraFile
from lightpen.formats.pen_files import write_pen
from lightpen.model.bending import ASSUMED
from lightpen.model.names import Origin
from lightpen.record.results.result_folder import FolderArchive
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.probing.current_tip import (
    CurrentTip,
    read_tip_in_force,
)
from lightpen_extensions.measure.probing.sources import (
    instrument_of,
    read_viewers,
    viewers_of_camera,
)

MASK = np.array([[10.0, 20.0, 5.0]])
TIPS = np.array([[0.0, -90.0, -25.0], [1.0, -91.0, -26.0], [2.0, -92.0, -27.0]])


def read(folder: Path, preparation: Preparation) -> CurrentTip:
    return read_tip_in_force(FolderArchive(folder), preparation)


def test_the_instrument_is_that_of_the_swing(
    tmp_path: Path, prepared: Preparation
) -> None:
    accept_tip(tmp_path, prepared)
    chosen = replace(prepared, mask=MASK).with_temperature(21.5)
    tip = read(tmp_path, chosen)
    fitted, one = tip.calibration.calibration.instrument, tip.instrument

    assert prepared.pen is not None
    assert (tip.names, tip.origin) == (prepared.names, Origin.SIMULATED)
    np.testing.assert_array_equal(one.camera.intrinsics, fitted.intrinsics)
    # At the temperature of the measurement, the LEDs are farther from the tip.
    growth = one.pen.diameter / fitted.disc_diameter_mm - 1
    assert growth != 0
    arms = np.array(fitted.leds_mm) - tip.calibration.tip_pen
    larger = one.pen.leds - tip.calibration.tip_pen
    np.testing.assert_allclose(larger, (1 + growth) * arms, atol=1e-9)
    np.testing.assert_array_equal(one.tip_pen, tip.calibration.tip_pen)
    assert one.sigma == tip.calibration.calibration.sigma_px
    assert one.rig.covariance is None
    assert (tip.temperature_c, tip.humidity_percent) == (21.5, None)
    assert tip.region.mask is chosen.mask
    assert tip.region.others == ()


def test_the_cameras_of_a_rig_stand_as_its_swing_left_them(
    tmp_path: Path, prepared_by_two: Preparation
) -> None:
    accept_tip(tmp_path, prepared_by_two)
    assert prepared_by_two.second is not None
    tip = read(
        tmp_path,
        replace(
            prepared_by_two,
            mask=MASK,
            second=replace(prepared_by_two.second, mask=2 * MASK),
        ),
    )
    fitted, rig = tip.calibration.calibration.instrument, tip.instrument.rig
    (other,) = fitted.other_cameras

    np.testing.assert_array_equal(rig.cameras[0].intrinsics, fitted.intrinsics)
    np.testing.assert_array_equal(rig.cameras[1].intrinsics, other.intrinsics)
    np.testing.assert_array_equal(
        rig.rotations, [np.eye(3), other.cam_from_rig_rotation]
    )
    np.testing.assert_array_equal(
        rig.translations, [np.zeros(3), other.cam_from_rig_translation_mm]
    )
    np.testing.assert_array_equal([tip.region.mask], [MASK])
    np.testing.assert_array_equal([tip.region.others[0].mask], [2 * MASK])
    assert tip.region.others[0].camera is rig.cameras[1]
    assert len(tip.viewers.files) == 3
    assert prepared_by_two.rig_file is not None
    again = read_viewers(None, prepared_by_two.rig_file.path)
    assert again is not None
    assert again.hashes == tip.viewers.hashes
    assert read_viewers(None, None) is None
    with pytest.raises(ValueError, match="must be chosen"):
        read(
            tmp_path,
            replace(
                prepared_by_two, second=replace(prepared_by_two.second, rig_file=None)
            ),
        )
    with pytest.raises(UsageError, match="has no accepted calibration"):
        read(tmp_path / "empty", prepared_by_two)


def other_camera(prepared: Preparation, folder: Path) -> CameraFile:
    """Another file with another camera."""
    assert prepared.camera_file is not None
    path = folder / "other.yaml"
    text = prepared.camera_file.path.read_text(encoding="utf-8")
    path.write_text(f"{text}\n# serviced\n", encoding="utf-8")
    return CameraFile.read(path)


def test_before_another_camera_its_file_counts(
    tmp_path: Path, prepared: Preparation
) -> None:
    accept_tip(tmp_path, prepared)
    file = other_camera(prepared, tmp_path)
    usual = read(tmp_path, prepared)
    tip = read(tmp_path, replace(prepared, camera_file=file))
    at, known = tip.instrument.parameters, usual.instrument.covariance

    np.testing.assert_array_equal(
        tip.instrument.camera.intrinsics, file.camera.intrinsics
    )
    for part in (at.tip, at.leds):
        np.testing.assert_allclose(
            tip.instrument.covariance[part, part], known[part, part]
        )
    assert not tip.instrument.covariance[at.tip, at.cameras[0]].any()
    assert not tip.is_like(usual)


def test_a_tip_by_other_means_than_a_joint_fit_has_the_files_as_they_are(
    tmp_path: Path, prepared: Preparation
) -> None:
    accept_tip(tmp_path, prepared)
    tip = read(tmp_path, prepared)
    record = tip.calibration.calibration
    pivot = replace(
        tip.calibration, calibration=structs.replace(record, method="pivot")
    )
    assert prepared.pen_file is not None
    found = instrument_of(
        pivot, tip.viewers, prepared.pen_file.pen, prepared.pen_file.path
    )
    at = found.parameters

    pen = prepared.pen_file.pen
    np.testing.assert_array_equal(found.pen.leds, pen.leds)
    bent = np.diag([0, ASSUMED**2, 0])
    np.testing.assert_allclose(
        found.covariance[at.tip, at.tip], np.array(record.covariance)[:3, :3] + bent
    )
    assert found.sigma == record.sigma_px


def test_a_calibration_of_another_pen_or_other_leds_is_refused(
    tmp_path: Path, prepared: Preparation
) -> None:
    accept_tip(tmp_path, prepared)
    tip = read(tmp_path, prepared)
    assert prepared.pen_file is not None
    pen, path = prepared.pen_file.pen, prepared.pen_file.path
    other = tmp_path / "other.json"
    write_pen(replace(pen, leds=pen.leds + 0.01), other)
    fewer = replace(pen, leds=pen.leds[:-1], normals=pen.normals[:-1])

    for each, file in ((pen, other), (fewer, path)):
        with pytest.raises(UsageError) as refused:
            instrument_of(tip.calibration, tip.viewers, each, file)
        assert refused.value.message.code == "verification.another-pen"


@pytest.mark.parametrize(
    ("entered", "of_pen", "of_swing", "which"),
    [(0, 1, 2, 0), (None, 1, 2, 1), (None, None, 2, 2), (None, None, None, None)],
)
def test_the_nominal_tip_is_the_entered_one_or_that_of_the_pen_or_of_the_swing(
    tmp_path: Path,
    prepared: Preparation,
    entered: int | None,
    of_pen: int | None,
    of_swing: int | None,
    which: int | None,
) -> None:
    def tip(known: int | None) -> FloatArray | None:
        return None if known is None else TIPS[known]

    accept_tip(tmp_path, replace(prepared, nominal_tip=tip(of_swing)))
    assert prepared.pen_file is not None
    pen = replace(prepared.pen_file.pen, nominal_tip=tip(of_pen))
    pen_file = replace(prepared.pen_file, pen=pen)
    chosen = replace(prepared, nominal_tip=tip(entered), pen_file=pen_file)

    found, expected = read(tmp_path, chosen).nominal_tip, tip(which)

    assert (found is None) == (expected is None)
    np.testing.assert_array_equal([found], [expected])


def test_points_are_valid_for_the_same_tip_with_the_same_files_and_mask_alone(
    tmp_path: Path, prepared: Preparation
) -> None:
    accept_tip(tmp_path, prepared)
    tip = read(tmp_path, prepared)
    assert prepared.camera_file is not None
    other = viewers_of_camera(prepared.camera_file.camera, tip.pen_file.path)

    assert tip.is_like(read(tmp_path, prepared))
    for unlike in (
        replace(tip, names=replace(tip.names, tip="T-11")),
        replace(tip, origin=Origin.LIVE),
        replace(tip, tip_file=tip.pen_file),
        replace(tip, pen_file=tip.tip_file),
        replace(tip, viewers=other),
        replace(tip, masks=(MASK,)),
    ):
        assert not tip.is_like(unlike)
