"""Tests of reading and writing camera files."""

import contextlib
import json
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, LightpenError, UsageError
from lightpen.formats.camera_checks import LARGEST_FOLD
from lightpen.formats.camera_files import FOCAL_CORRELATION, read_camera
from lightpen.formats.rig_files import write_camera
from lightpen.model.camera import Camera, LensModel, unmodelled_effects_of
from lightpen.model.fisheye import LensField
from lightpen.model.self_calibration import FoundCamera

DISTORTION = np.array([-0.082, 0.105, 3e-4, -2e-4, 1 / 3])
OPENCV = """%YAML:1.0
---
image_width: 2448
image_height: 2048
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 4638.1999999999998, 0., 1219.5999999999999, 0.,
       4637.1000000000004, 1031.3, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.082000000000000003, 0.105, 0.00029999999999999997,
       -0.00020000000000000001, 0.33333333333333331 ]
"""
ROS = """image_width: 2448
image_height: 2048
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: [4638.2, 0, 1219.6, 0, 4637.1, 1031.3, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.082, 0.105, 0.0003, -0.0002, 0.3333333333333333]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
"""
ROS_MESSAGE = """height: 2048
width: 2448
distortion_model: "plumb_bob"
D: [-0.082, 0.105, 0.0003, -0.0002, 0.3333333333333333]
K: [4638.2, 0.0, 1219.6, 0.0, 4637.1, 1031.3, 0.0, 0.0, 1.0]
"""
ECHOED = "".join(f"header: {{seq: {i}}}\n{ROS_MESSAGE}---\n" for i in range(3))
OPENCV_JS = json.dumps(
    {
        "imageSize": {"width": 2448, "height": 2048},
        "cameraMatrix": dict(
            enumerate([4638.2, 0, 1219.6, 0, 4637.1, 1031.3, 0, 0, 1])
        ),
        "distCoeffs": {"rows": 5, "cols": 1, "data64F": DISTORTION.tolist()},
    }
)
KALIBR = """cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.082, 0.105, 0.0003, -0.0002]
  distortion_model: radtan
  intrinsics: [4638.2, 4637.1, 1219.6, 1031.3]
  resolution: [2448, 2048]
  rostopic: /cam0/image_raw
"""
MATLAB: dict[str, Any] = {
    "FocalLength": [4638.2, 4637.1],
    "PrincipalPoint": [1220.6, 1032.3],
    "ImageSize": [2048, 2448],
    "RadialDistortion": [-0.082, 0.105, 1 / 3],
    "TangentialDistortion": [3e-4, -2e-4],
    "Skew": 0,
}


def camera(**changes: Any) -> Camera:
    values: dict[str, Any] = {
        "width": 2448,
        "height": 2048,
        "fx": 4638.2,
        "fy": 4637.1,
        "cx": 1219.6,
        "cy": 1031.3,
        "distortion": DISTORTION,
    }
    return Camera(**(values | changes))


def saved(folder: Path, text: str, name: str = "cam.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refusal(folder: Path, text: str) -> str:
    path = saved(folder, text)
    with pytest.raises(FileError) as info:
        read_camera(path)
    return str(info.value)


def assert_same(found: Camera, expected: Camera, atol: float = 0.0) -> None:
    assert (found.width, found.height) == (expected.width, expected.height)
    np.testing.assert_allclose(found.intrinsics, expected.intrinsics, rtol=0, atol=atol)
    assert found.calibrated_on == expected.calibrated_on
    assert found.serial == expected.serial
    assert found.temperature_c == expected.temperature_c
    if expected.covariance is None:
        assert found.covariance is None
    else:
        assert found.covariance is not None
        np.testing.assert_array_equal(found.covariance, expected.covariance)


def opencv_file(path: Path, entries: dict[str, Any]) -> Path:
    # In memory: on Windows, OpenCV opens no path with letters of other languages.
    flags = cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY
    storage = cv2.FileStorage(path.suffix, flags)
    for name, value in entries.items():
        storage.write(name, value)
    path.write_text(storage.releaseAndGetString(), encoding="utf-8")
    return path


def read_by_opencv(path: Path) -> cv2.FileStorage:
    flags = cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY
    return cv2.FileStorage(path.read_text(encoding="utf-8"), flags)


@pytest.mark.parametrize(
    "text", [OPENCV, OPENCV_JS, ROS, ROS_MESSAGE, ECHOED], ids=list("12345")
)
def test_layouts_with_a_camera_matrix_are_read(tmp_path: Path, text: str) -> None:
    assert_same(read_camera(saved(tmp_path, text)), camera())


def test_messages_of_two_cameras_are_not_one(tmp_path: Path) -> None:
    text = f"{ROS_MESSAGE}---\n{ROS_MESSAGE.replace('1219', '1218')}"
    assert "more than one YAML document" in refusal(tmp_path, text)


def test_a_chain_of_kalibr_is_read(tmp_path: Path) -> None:
    found = read_camera(saved(tmp_path, KALIBR))
    assert_same(found, camera(distortion=np.array([-0.082, 0.105, 3e-4, -2e-4, 0])))


def test_a_single_camera_of_kalibr_is_read(tmp_path: Path) -> None:
    text = "\n".join(line.strip() for line in KALIBR.splitlines()[1:])
    assert read_camera(saved(tmp_path, text)).fx == 4638.2


@pytest.mark.parametrize(
    "matrix",
    [
        {},
        {"K": [[4638.2, 0, 1220.6], [0, 4637.1, 1032.3], [0, 0, 1]]},
        {"IntrinsicMatrix": [[4638.2, 0, 0], [0, 4637.1, 0], [1220.6, 1032.3, 1]]},
    ],
    ids=["focal length", "K", "transposed matrix of old versions"],
)
def test_pixels_of_matlab_count_from_zero_here(
    tmp_path: Path, matrix: dict[str, Any]
) -> None:
    entries = MATLAB | matrix
    if matrix:
        del entries["FocalLength"], entries["PrincipalPoint"]
    for text in (json.dumps(entries), json.dumps({"Intrinsics": entries})):
        # 1220.6 - 1 is not the double nearest to 1219.6
        assert_same(read_camera(saved(tmp_path, text)), camera(), atol=1e-12)


def test_two_radial_coefficients_of_matlab_leave_k3_zero(tmp_path: Path) -> None:
    text = json.dumps(MATLAB | {"RadialDistortion": [-0.082, 0.105]})
    found = read_camera(saved(tmp_path, text))
    np.testing.assert_array_equal(found.distortion, [-0.082, 0.105, 3e-4, -2e-4, 0])


@pytest.mark.parametrize("suffix", ["yaml", "yml", "xml", "json"])
def test_files_of_opencv_give_what_opencv_reads(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(1)
    matrix = np.array([[4638.2 / 3, 0, 1219.6 / 3], [0, 1545.7, 343.7], [0, 0, 1]])
    distortion = rng.normal(0, 0.1, (1, 8))
    path = opencv_file(
        tmp_path / f"cam.{suffix}",
        {
            "calibration_time": "Thu Jan  2 23:04:05 2025",
            "image_width": 1000,
            "image_height": 700,
            "cameraMatrix": matrix,
            "distCoeffs": distortion,
        },
    )
    storage = read_by_opencv(path)
    expected_matrix = storage.getNode("cameraMatrix").mat()
    expected_distortion = storage.getNode("distCoeffs").mat().ravel()
    storage.release()
    found = read_camera(path)
    np.testing.assert_array_equal(found.matrix, expected_matrix)
    np.testing.assert_array_equal(found.distortion, expected_distortion)
    assert found.calibrated_on == date(2025, 1, 2)


@pytest.mark.parametrize("suffix", ["yaml", "xml", "json"])
def test_single_precision_of_opencv_is_kept(tmp_path: Path, suffix: str) -> None:
    distortion = np.array([[0.1, 0.2, 1e-3 / 3, 4e-4, 0.5]], dtype=np.float32)
    path = opencv_file(
        tmp_path / f"cam.{suffix}",
        {
            "image_width": 2448,
            "image_height": 2048,
            "camera_matrix": camera().matrix,
            "dist_coeffs": distortion,
        },
    )
    np.testing.assert_array_equal(
        read_camera(path).distortion, distortion[0].astype(np.float64)
    )


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("camera_matrix", "cameraMatrix"),
        ("camera_matrix", "Camera_Matrix"),
        ("distortion_coefficients", "Distortion_Coefficients"),
        ("distortion_coefficients", "dist_coeffs"),
        ("distortion_coefficients", "distCoeffs"),
        ("image_width", "image_Width"),
        ("%YAML:1.0", "%YAML 1.2"),
        ("%YAML:1.0\n---\n", ""),
        ("%YAML:1.0\n---\n", "# by hand\n"),
        ("2448\nimage_height: 2048", "2448\nimage_height: 2048 # px"),
        ("image_width: 2448\nimage_height: 2048", "image_size: [2448, 2048]"),
        ("\n", "\r\n"),
    ],
)
def test_other_spellings_mean_the_same(tmp_path: Path, name: str, other: str) -> None:
    assert name in OPENCV
    path = tmp_path / "cam.yaml"
    path.write_bytes(OPENCV.replace(name, other).encode())
    assert_same(read_camera(path), camera())


def test_plain_numbers_in_rows_are_a_matrix(tmp_path: Path) -> None:
    text = (
        "image_size: 2448x2048\nK: [[4638.2, 0, 1219.6], [0, 4637.1, 1031.3], "
        f"[0, 0, 1]]\ndist: {DISTORTION.tolist()}\n"
    )
    assert_same(read_camera(saved(tmp_path, text)), camera())


def test_four_coefficients_leave_k3_zero(tmp_path: Path) -> None:
    text = json.dumps(
        {
            "image_size": [2448, 2048],
            "K": camera().matrix.tolist(),
            "D": DISTORTION[:4].tolist(),
            "intrinsics_covariance": np.eye(8).tolist(),
        }
    )
    found = read_camera(saved(tmp_path, text))
    np.testing.assert_array_equal(found.distortion, [*DISTORTION[:4], 0])
    assert found.covariance is not None
    np.testing.assert_array_equal(np.diagonal(found.covariance), [1] * 8 + [0])


@pytest.mark.parametrize("count", [12, 14])
def test_thin_prism_terms_of_zero_are_dropped(tmp_path: Path, count: int) -> None:
    coefficients = np.arange(1, count + 1) / 1000 * (np.arange(count) < 8)
    text = json.dumps(
        {
            "image_size": [2448, 2048],
            "K": camera().matrix.tolist(),
            "D": coefficients.tolist(),
            "std_deviations_intrinsics": [0.5] * (4 + count),
        }
    )
    found = read_camera(saved(tmp_path, text))
    np.testing.assert_array_equal(found.distortion, coefficients[:8])
    expected = 0.25 * np.eye(12)
    expected[0, 1] = expected[1, 0] = 0.25 * FOCAL_CORRELATION
    np.testing.assert_array_equal(found.covariance, expected)


@pytest.mark.parametrize("suffix", ["yaml", "xml", "json"])
def test_standard_deviations_of_opencv_are_kept(tmp_path: Path, suffix: str) -> None:
    """calibrateCameraExtended gives 18 of them, whatever the number estimated."""
    deviations = np.zeros((18, 1))
    deviations[:9, 0] = [0.3, 0.3, 0.2, 0.2, 1e-3, 1e-2, 1e-5, 1e-5, 1e-1]
    path = opencv_file(
        tmp_path / f"cam.{suffix}",
        {
            "image_width": 2448,
            "image_height": 2048,
            "camera_matrix": camera().matrix,
            "distortion_coefficients": DISTORTION[None],
            "std_deviations_intrinsics": deviations,
        },
    )
    covariance = read_camera(path).covariance
    assert covariance is not None
    np.testing.assert_array_equal(np.diag(covariance), deviations[:9, 0] ** 2)
    # Both focal lengths go with the distance of the board; files with the whole
    # covariance have 0.99 for them.
    assert covariance[0, 1] == covariance[1, 0] == pytest.approx(0.99 * 0.3**2)
    covariance[[0, 1], [1, 0]] = 0.0
    np.testing.assert_array_equal(covariance, np.diag(np.diag(covariance)))


def test_standard_deviations_leave_the_ratio_of_the_focal_lengths_well_known(
    tmp_path: Path,
) -> None:
    text = f"{OPENCV}std_deviations_intrinsics: {[5.0, 5.0] + [1e-3] * 7}\n"
    covariance = read_camera(saved(tmp_path, text)).covariance
    assert covariance is not None

    difference = np.array([1.0, -1.0])
    assert np.sqrt(difference @ covariance[:2, :2] @ difference) < 1.0  # px, of 7
    assert np.linalg.eigvalsh(covariance).min() > 0


@pytest.mark.parametrize(
    ("text", "day"),
    [
        ('calibration_date: "2025-03-04"', date(2025, 3, 4)),
        ("calibration_date: 2025-03-04T12:00:00Z", date(2025, 3, 4)),
        ("calibration_time: 2025/03/04 12:00", date(2025, 3, 4)),
        ('calibration_time: "Tue Mar  4 12:00:00 2025"', date(2025, 3, 4)),
        ("calibration_time: 03/04/25", None),
        ("calibration_time: 2025-13-04", None),
        ("calibration_time: [2025, 3]", None),
    ],
)
def test_a_date_is_kept_if_it_exists_in_any_time_zone(
    tmp_path: Path, text: str, day: date | None
) -> None:
    assert read_camera(saved(tmp_path, OPENCV + text)).calibrated_on == day


@pytest.mark.parametrize(
    ("text", "serial"),
    [
        ('camera_serial: "21704342"', "21704342"),
        ("camera_serial: 21704342", "21704342"),
        ("camera_serial: [1, 2]", ""),
    ],
)
def test_the_serial_number_is_kept(tmp_path: Path, text: str, serial: str) -> None:
    assert read_camera(saved(tmp_path, OPENCV + text)).serial == serial


def test_a_temperature_that_no_camera_has_is_refused(tmp_path: Path) -> None:
    words = refusal(tmp_path, OPENCV + "calibration_temperature: 293.15")

    assert "degrees Celsius from -50 to 100" in words


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("image_width: 2448\n", "", "does not state the image size."),
        ("2448", "2448.5", "image size of 2448.5 x 2048 px"),
        ("2448", "0", "image size of 0 x 2048 px"),
        ("2448", "1e999", 'image_width .*"1e999" is too large'),
        ("2448", "9" * 5000, "is too large."),
        ("2448", "[2448, 1]", "image_width .* has 2 numbers where 1 are needed"),
        ("2448", "wide", 'image_width .* "wide" is not a number'),
        ("4638.1999999999998", ".Nan", r'camera_matrix .* "\.Nan" is not a finite'),
        ("4638.1999999999998", "-.Inf", "is not a finite number"),
        ("4638.1999999999998", "463O", r"is not a number"),
        ("4638.1999999999998", "-4638", "focal lengths -4638 and 4637.1 px"),
        ("4638.1999999999998", "16.0", "may be in millimetres"),
        ("4638.1999999999998", "2000", "2000 and 4637.1 px along u and v"),
        ("1031.3", "103100", r"principal point at \(1219.6, 103100\) px, far outside"),
        ("4638.1999999999998, 0.", "4638.1999999999998, 0.5", "skew of 0.5 px"),
        ("0., 0., 1.", "0., 0., 2.", "not of the form fx 0 cx, 0 fy cy, 0 0 1"),
        ("0., 0., 1. ]", "0., 0. ]", "8 numbers where its 3 rows of 3 need 9"),
        ("   rows: 1\n   cols: 5", "   rows: 1\n   cols: 6", "5 numbers where its 1"),
        (", 0.33333333333333331 ]", ", 1, 2 ]", "6 numbers where its 1 rows of 5"),
        ("dt: d", "dt: !!python/object/apply:os.getcwd []", "tag .*For security"),
        ("camera_matrix", "camera", "and no camera_matrix"),
        ("distortion_coefficients", "bending", "does not state the distortion"),
        ("image_height:", "image_width:", 'image_width" is given a second time'),
        ("image_height:", "imageWidth: 5\nimage_height:", "which mean the same"),
        ("image_height:", "width: 5\nimage_height:", "which mean the same"),
        ("image_height: 2048", "image_height: &h 2048", "anchor or alias"),
    ],
)
def test_a_flaw_of_a_camera_file_is_named(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    assert old in OPENCV
    with pytest.raises(FileError, match=sentence):
        read_camera(saved(tmp_path, OPENCV.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("radtan", "fov", "fisheye lens"),
        ("radtan", "thin_prism", 'model "thin_prism", which is not supported'),
        ("pinhole", "omni", 'model "omni"; the model pinhole is needed'),
        (", 1031.3]", "]", "intrinsics .* has 3 numbers where 4 are needed"),
        ("[2448, 2048]", "[]", "resolution .* has 0 numbers where 2 are needed"),
        (KALIBR, KALIBR + KALIBR.replace("cam0", "cam1"), "describes 2 cameras"),
        (KALIBR, "cam0: ", "the entries cam0, and no camera_matrix"),
    ],
)
def test_a_flaw_of_a_chain_is_named(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    assert old in KALIBR
    with pytest.raises(FileError, match=sentence):
        read_camera(saved(tmp_path, KALIBR.replace(old, new, 1)))


def test_a_fisheye_is_read_back_as_written(tmp_path: Path) -> None:
    camera = Camera(
        *(1280, 800, 380.0, 381.0, 645.0, 396.0),
        distortion=np.array([-0.02, 0.01, -0.006, 0.001]),
        covariance=np.diag(np.arange(1.0, 9.0)),
        serial="7",
        lens=LensModel.KANNALA_BRANDT,
    )
    write_camera(camera, tmp_path / "camera.yaml")
    found = read_camera(tmp_path / "camera.yaml")

    assert found.lens is LensModel.KANNALA_BRANDT
    np.testing.assert_array_equal(found.intrinsics, camera.intrinsics)
    assert camera.covariance is not None
    assert found.covariance is not None
    np.testing.assert_array_equal(found.covariance, camera.covariance)
    assert (found.image_size, found.serial) == (camera.image_size, "7")


def test_an_equidistant_file_of_ros_needs_four_coefficients(tmp_path: Path) -> None:
    text = refusal(tmp_path, ROS.replace("plumb_bob", "equidistant"))

    assert "the fisheye model needs 4" in text


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"ImageSize": []}, "ImageSize in cam.yaml has 0 numbers where 2 are needed"),
        ({"ImageSize": None}, "ImageSize in cam.yaml cannot be read"),
        ({"RadialDistortion": [1.0]}, "1 number where 2 or 3 are needed"),
        ({"TangentialDistortion": [1.0]}, "1 number where 2 are needed"),
        ({"Skew": 0.2}, "skew of 0.2 px"),
        ({"Skew": []}, "Skew in cam.yaml has 0 numbers"),
        ({"FocalLength": ["wide", 1]}, '"wide" is not a number'),
        ({"MappingCoefficients": [1, 2]}, "fisheye lens"),
    ],
)
def test_a_flaw_of_a_file_of_matlab_is_named(
    tmp_path: Path, change: dict[str, Any], sentence: str
) -> None:
    assert sentence in refusal(tmp_path, json.dumps(MATLAB | change))


@pytest.mark.parametrize(
    ("covariance", "sentence"),
    [
        (np.eye(8), "intrinsics_covariance in cam.yaml has 64 numbers where 81"),
        (-np.eye(9), "is not a covariance"),
        (np.ones((9, 9)) + np.eye(9)[::-1], "is not a covariance"),
        (np.eye(9) + np.triu(np.full((9, 9), 0.1), 1), "is not a covariance"),
    ],
)
def test_what_is_no_covariance_is_refused(
    tmp_path: Path, covariance: FloatArray, sentence: str
) -> None:
    text = f"{OPENCV}intrinsics_covariance: {covariance.tolist()}\n"
    assert sentence in refusal(tmp_path, text)


def measured_field() -> LensField:
    rng = np.random.default_rng(4)
    field = LensField.of(2448, 2048, 0.02, 700.0)
    root = rng.normal(size=(len(field.nodes), 60))
    return replace(
        field,
        values=rng.normal(size=(len(field.nodes), 2)),
        covariance=root @ root.T / 1e4,
        intrinsics_covariance=root[:9] @ root[:9].T / 1e3,
    )


def test_a_lens_field_is_read_back_to_the_last_digit(tmp_path: Path) -> None:
    expected, path = measured_field(), tmp_path / "cam.yaml"
    write_camera(replace(camera(), lens_field=expected), path)
    found = read_camera(path).lens_field
    assert found is not None
    np.testing.assert_array_equal(found.values, expected.values)
    np.testing.assert_array_equal(found.covariance, expected.covariance)
    beside = found.intrinsics_covariance, expected.intrinsics_covariance
    np.testing.assert_array_equal(*beside)
    assert (found.columns, found.rows) == (expected.columns, expected.rows)
    assert (found.amplitude, found.length) == (0.02, 700.0)


def test_opencv_reads_a_file_with_a_lens_field(tmp_path: Path) -> None:
    field, path = measured_field(), tmp_path / "cam.yaml"
    write_camera(replace(camera(), lens_field=field), path)
    storage = read_by_opencv(path)
    values = storage.getNode("lens_field").getNode("values").mat()
    np.testing.assert_array_equal(values, field.values)
    storage.release()


def test_amplitude_and_length_alone_are_a_field_that_was_not_measured(
    tmp_path: Path,
) -> None:
    text = OPENCV + "lens_field: {amplitude: 0.03, correlation_length: 600}\n"
    found = read_camera(saved(tmp_path, text)).lens_field
    assert found is not None
    np.testing.assert_array_equal(found.values, 0.0)
    np.testing.assert_allclose(np.diag(found.covariance), 0.03**2)


@pytest.mark.parametrize(
    ("field", "sentence"),
    [
        ("{amplitude: -1, correlation_length: 600}", "amplitude -1 px and"),
        ("{amplitude: 0.1, correlation_length: 2}", "length 2 px; .* from 10 px"),
        ("{amplitude: 0.1}", "has no correlation_length"),
        ("{amplitude: 0.1, correlation_length: 600, sigma: 1}", "sigma"),
        (
            "{amplitude: 1, correlation_length: 600, values: 1, columns: 99, rows: 2}",
            "99 columns and 2 rows",
        ),
        (
            "{amplitude: 0.1, correlation_length: 600, columns: 2, rows: 2, "
            "values: [1, 1, 1, 1, 1, 1, 1, 1], "
            "covariance: [1, 9, 0, 0, 9, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}",
            "covariance of the lens field of cam.yaml is not",
        ),
    ],
)
def test_a_flaw_of_a_lens_field_is_named(
    tmp_path: Path, field: str, sentence: str
) -> None:
    with pytest.raises(FileError, match=sentence):
        read_camera(saved(tmp_path, f"{OPENCV}lens_field: {field}\n"))


@pytest.mark.parametrize("deviations", [[0.1] * 8, [-0.1] * 9])
def test_wrong_standard_deviations_are_refused(
    tmp_path: Path, deviations: list[float]
) -> None:
    text = f"{OPENCV}std_deviations: {deviations}\n"
    assert "std_deviations in cam.yaml must hold 9 numbers" in refusal(tmp_path, text)


@pytest.mark.parametrize(
    ("coefficients", "sentence"),
    [
        ([0.1] * 6, "6 distortion coefficients; 4, 5 or 8 are needed"),
        ([0.1] * 12, "thin prism or a tilted sensor"),
        ([], "0 distortion coefficients"),
    ],
)
def test_distortion_of_another_model_is_refused(
    tmp_path: Path, coefficients: list[float], sentence: str
) -> None:
    entries = {
        "image_size": [2448, 2048],
        "K": camera().matrix.tolist(),
        "D": coefficients,
    }
    assert sentence in refusal(tmp_path, json.dumps(entries))


@pytest.mark.parametrize(
    ("k1", "share"), [(-1.2, 0.0), (-1.3, 0.05), (-6.0, 0.8), (9.0, 0.0)]
)
def test_distortion_may_fold_the_image_in_its_corners_only(
    tmp_path: Path, k1: float, share: float
) -> None:
    """The corner is at 0.346, the image of the fold at 2 / 3 sqrt(-1 / (3 k1))."""
    entries = {
        "image_size": [2448, 2048],
        "K": camera().matrix.tolist(),
        "D": [k1, 0, 0, 0],
    }
    if share > LARGEST_FOLD:
        sentence = "of cam.yaml fold the image of 2448 x 2048 px"
        assert sentence in refusal(tmp_path, json.dumps(entries))
        return
    found = read_camera(saved(tmp_path, json.dumps(entries)))
    assert found.distortion[0] == k1
    assert found.folded_share <= share
    assert (found.folded_share > 0) == (share > 0)
    fold = 2 / 3 * np.sqrt(-1 / (3 * k1)) if k1 < 0 else np.inf
    pixels = np.random.default_rng(1).uniform(0, [2447, 2047], (2000, 2))
    distances = np.linalg.norm((pixels - found.matrix[:2, 2]) / found.fx, axis=1)
    clear = np.abs(distances - fold) > 1e-3
    np.testing.assert_array_equal(found.sees(pixels[clear]), distances[clear] < fold)
    doubts = unmodelled_effects_of(found, date(2026, 1, 1))
    assert [each.code for each in doubts] == ["camera-validity.fold"] * (share > 0)


@pytest.mark.parametrize(
    "text", [OPENCV, ROS, KALIBR, json.dumps(MATLAB)], ids=["1", "2", "3", "4"]
)
def test_a_file_cut_short_anywhere_is_read_the_same_or_refused(
    tmp_path: Path, text: str
) -> None:
    whole = read_camera(saved(tmp_path, text))
    for length in range(1, len(text)):
        with contextlib.suppress(FileError):
            assert_same(read_camera(saved(tmp_path, text[:length])), whole)


BILLION_LAUGHS_XML = (
    '<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY lol "lol">'
    + "".join(
        f'<!ENTITY lol{n} "{f"&lol{n - 1};" * 10}">' for n in range(1, 10)
    ).replace("lol0", "lol")
    + "]><opencv_storage>&lol9;</opencv_storage>"
)
BILLION_LAUGHS_YAML = "a0: &a0 [lol]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 10)
)


@pytest.mark.parametrize(
    "text",
    [
        BILLION_LAUGHS_XML,
        BILLION_LAUGHS_YAML,
        '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>',
        "<a>" * 100_000,
        "<a>" + "<b/>" * 100_000 + "</a>",
        "[" * 200_000,
        "a: " + "[" * 200_000,
        "a: " + "{a: " * 50_000,
        '{"a":' * 200_000,
        '{"a": ' + "[" * 500 + "]" * 500 + "}",
        "- " * 100_000,
        "".join(f"{' ' * n}a:\n" for n in range(1000)),
        '{"a": 1, "a": 2}',
        "a: 1\n---\nb: 2\n",
        "? [a, b]\n: 1\n",
        "[1, 2]",
        '"camera"',
        "<a>5</a>",
        "%YAML:1.0\n---\n",
        '{"image_width": NaN}',
        "a: !!binary |\n  QUJD\n",
        "a: \ue000: b",
    ],
    ids=range(22),
)
def test_hostile_content_is_refused(tmp_path: Path, text: str) -> None:
    assert "cam.yaml" in refusal(tmp_path, text)


def test_a_camera_with_a_document_type_definition_is_refused(tmp_path: Path) -> None:
    head = '<?xml version="1.0"?>'
    definition = '<!DOCTYPE a [<!ENTITY w "2448">]>'
    assert_same(read_camera(saved(tmp_path, XML)), camera())
    text = XML.replace(head, head + definition).replace("2448", "&w;")
    assert "Line 1 of cam.yaml begins a document type" in refusal(tmp_path, text)


def test_code_in_a_file_is_not_run(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    for tag in ("python/object/apply:os.mkdir", "python/object/new:os.mkdir"):
        text = f"{OPENCV}extra: !!{tag} ['{trace}']\n"
        assert f'Line 17 of cam.yaml has the tag "!!{tag}' in refusal(tmp_path, text)
    assert not trace.exists()


def test_a_huge_camera_file_is_refused(tmp_path: Path) -> None:
    assert "the maximum is 4 MB." in refusal(tmp_path, OPENCV + "#" * 5_000_000)


SERIAL_LETTERS = st.characters(min_codepoint=33, max_codepoint=126)
mild = st.floats(-1e-14, 1e-14)  # at the corner of the widest image r^6 is 5e10


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    n = draw(st.sampled_from([5, 8]))
    covariance = None
    if draw(st.booleans()):
        rng = np.random.default_rng(draw(st.integers(0, 1000)))
        root = rng.normal(size=(4 + n, 4 + n)) * 10.0 ** rng.integers(-8, 3, 4 + n)
        covariance = root.T @ root
        covariance = (covariance + covariance.T) / 2
    fx = draw(st.floats(300, 1e6))
    return Camera(
        width=draw(st.integers(1, 9000)),
        height=draw(st.integers(1, 9000)),
        fx=fx,
        fy=fx * draw(st.floats(0.7, 1.4)),
        cx=draw(st.floats(0, 1)),
        cy=draw(st.floats(0, 1)),
        distortion=np.array(draw(st.lists(mild, min_size=n, max_size=n))),
        covariance=covariance,
        calibrated_on=draw(st.none() | st.dates()),
        serial=draw(st.text(SERIAL_LETTERS, max_size=20)),
        temperature_c=draw(st.none() | st.floats(-50, 100)),
    )


@pytest.mark.parametrize("covariance", [None, np.diag(np.arange(1.0, 10.0))])
def test_what_was_known_of_a_camera_found_from_images_is_read_back(
    tmp_path: Path, covariance: np.ndarray | None
) -> None:
    marks = np.array([[1.25, 2.5], [1000.125, 2000.0]])
    known = FoundCamera(marks, camera().intrinsics + 0.5, covariance)
    plain = np.append(DISTORTION[:4], 0.0)
    write_camera(camera(distortion=plain, found=known), tmp_path / "cam.yaml")

    read = read_camera(tmp_path / "cam.yaml").found

    assert read is not None
    np.testing.assert_array_equal(read.marks, marks)
    np.testing.assert_array_equal(read.intrinsics, known.intrinsics)
    assert (read.covariance is None) == (covariance is None)
    if covariance is not None:
        np.testing.assert_array_equal(read.covariance, covariance)


def test_an_impossible_camera_before_its_images_is_refused(tmp_path: Path) -> None:
    values = camera().intrinsics
    values[0] = -1.0
    known = FoundCamera(np.ones((1, 2)), values, None)
    write_camera(camera(found=known), tmp_path / "cam.yaml")

    with pytest.raises(FileError, match="focal length"):
        read_camera(tmp_path / "cam.yaml")


@pytest.mark.slow
@given(cameras())
def test_any_camera_is_read_back_to_the_last_digit(
    tmp_path_factory: pytest.TempPathFactory, expected: Camera
) -> None:
    path = tmp_path_factory.getbasetemp() / "round_trip.yaml"
    write_camera(expected, path)
    assert_same(read_camera(path), expected)


@given(cameras())
def test_opencv_reads_what_is_written(
    tmp_path_factory: pytest.TempPathFactory, expected: Camera
) -> None:
    path = tmp_path_factory.getbasetemp() / "for_opencv.yaml"
    write_camera(expected, path)
    storage = read_by_opencv(path)
    assert storage.getNode("image_width").real() == expected.width
    assert storage.getNode("image_height").real() == expected.height
    np.testing.assert_array_equal(
        storage.getNode("camera_matrix").mat(), expected.matrix
    )
    np.testing.assert_array_equal(
        storage.getNode("distortion_coefficients").mat()[0], expected.distortion
    )
    if expected.covariance is not None:
        np.testing.assert_array_equal(
            storage.getNode("intrinsics_covariance").mat(), expected.covariance
        )
    storage.release()


def test_a_camera_is_written_as_yaml_only(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"cam\.xml does not end in \.yaml"):
        write_camera(camera(), tmp_path / "cam.xml")


@given(st.binary(max_size=300) | st.text(max_size=300).map(str.encode))
def test_any_content_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_bytes(data)
    with contextlib.suppress(LightpenError):
        read_camera(path)


XML = """<?xml version="1.0"?>
<opencv_storage>
<image_size>2448 2048</image_size>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    4638.2 0. 1219.6 0. 4637.1 1031.3 0. 0. 1.</data></camera_matrix>
<distCoeffs><_>-0.082</_><_>0.105</_><_>3e-4</_><_>-2e-4</_>
  <_>0.33333333333333331</_></distCoeffs>
</opencv_storage>
"""


def test_sequences_in_xml_are_read(tmp_path: Path) -> None:
    assert_same(read_camera(saved(tmp_path, XML)), camera())


def test_the_shared_camera_is_read(shared_data: Path) -> None:
    found = read_camera(shared_data / "swing-clean" / "camera.yaml")
    expected = camera(distortion=np.array([-0.082, 0.105, 3e-4, -2e-4, 0.0]))
    assert_same(found, expected)


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "camera_matrix: [" + "1," * 300_000 + "1]\n",
        '{"camera_matrix": [' + "1," * 300_000 + "1]}",
        "<opencv_storage><a>" + "<_></_>" * 300_000 + "</a></opencv_storage>",
    ],
    ids=["yaml", "json", "xml"],
)
def test_more_values_than_any_calibration_has_are_refused(
    tmp_path: Path, text: str
) -> None:
    assert "more than 200,000 values" in refusal(tmp_path, text)


def test_more_numbers_than_any_matrix_has_are_refused(tmp_path: Path) -> None:
    xml = "<a><camera_matrix>" + "1 " * 20_000 + "</camera_matrix>"
    xml += "<image_width>2</image_width><image_height>2</image_height></a>"

    assert "20000 numbers; at most 10000" in refusal(tmp_path, xml)


def test_a_camera_info_that_was_echoed_ends_with_an_empty_document(
    tmp_path: Path,
) -> None:
    path = tmp_path / "camera_info.yaml"
    path.write_text(
        "height: 720\nwidth: 1280\ndistortion_model: plumb_bob\n"
        "d: [-0.08, 0.1, 0.0001, -0.0002, 0.01]\n"
        "k: [900.0, 0.0, 635.5, 0.0, 900.0, 352.25, 0.0, 0.0, 1.0]\n---\n"
    )

    assert read_camera(path).intrinsics[:4].tolist() == [900.0, 900.0, 635.5, 352.25]


def test_the_results_of_the_toolbox_of_bouguet_are_named(tmp_path: Path) -> None:
    path = tmp_path / "Calib_Results.m"
    path.write_text("fc = [ 900 ; 900 ];\ncc = [ 635 ; 352 ];\nkc = [ 0 ; 0 ];\n")

    with pytest.raises(FileError, match=r"Bouguet.*jsonencode"):
        read_camera(path)
