"""Tests of reading the camera files of other programs."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.rig_files import write_window
from lightpen.model.camera import Camera, LensModel
from lightpen.model.fisheye import LensField

# f 1320.5, centre (652.25, 355.75) from the centre of the first pixel, k1 k2 p1 p2
PINHOLE = (1320.5, 1318.25, 652.25, 355.75)
BROWN = (-0.21, 0.09, 0.0007, -0.0004)
FISHEYE = (-0.02, 0.01, -0.006, 0.001)
SIZE = (1280, 720)
MATRIX: list[list[float]] = [[1320.5, 0, 652.25], [0, 1318.25, 355.75], [0, 0, 1]]
CALISCOPE = f"""# cameras
[cam_0]
port = 0
size = [1280, 720]
rotation_count = 0
error = 0.21
matrix = {MATRIX}
distortions = {[*BROWN, 0.0]}
exposure = -7
grid_count = 20
ignore = false
translation = [0.0, 0.0, 0.0]
rotation = [0.0, 0.0, 0.0]
"""
ANIPOSE = f"""[cam_0]
name = "A"
size = [ 1280, 720,]
matrix = [ [ 1320.5, 0.0, 652.25,], [ 0.0, 1318.25, 355.75,], [ 0.0, 0.0, 1.0,],]
distortions = [ {", ".join(map(str, BROWN))}, 0.0,]
rotation = [ 0.01, 0.02, 0.03,]
translation = [ 1.0, 2.0, 3.0,]

[metadata]
adjusted = false
error = 0.8
"""
CALISCOPE_NOW = CALISCOPE.replace("[cam_0]", "[cameras.0]").replace(
    "port = 0", "cam_id = 0\nfisheye = false"
)
MRCAL = """# generated on 2024-05-06 with mrcal-calibrate-cameras
{
    # how the lens is modelled
    'lensmodel':  'LENSMODEL_OPENCV8',

    'intrinsics': [ 1320.5, 1318.25, 652.25, 355.75, -0.21, 0.09, 7.e-4, -4.e-4,
                    0., 0., 0., 0.,],
    'valid_intrinsics_region': [ [ 1, 2 ], [ 3, 4 ], ],
    'extrinsics': [ 0., -0., 0., 0., 0., 0.,],
    'imagersize': [ 1280, 720,],
    'icam_intrinsics': 0,
    'optimization_inputs': b'P)h>@6aWAK2mk;8K>(!&{x}[1,`~'
}
"""
COLMAP = f"""# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 1
1 OPENCV 1280 720 1320.5 1318.25 652.75 356.25 {" ".join(map(str, BROWN))}
"""
METASHAPE = """<?xml version="1.0" encoding="UTF-8"?>
<calibration>
  <projection>frame</projection>
  <width>1280</width>
  <height>720</height>
  <f>1318.25</f>
  <cx>12.75</cx>
  <cy>-3.75</cy>
  <b1>2.25</b1>
  <k1>-0.21</k1>
  <k2>0.09</k2>
  <p1>-0.0004</p1>
  <p2>0.0007</p2>
  <date>2024-05-06T07:08:09Z</date>
</calibration>
"""


def calib_io(**changes: float) -> dict[str, Any]:
    values = {"f": 1320.5, "ar": 1318.25 / 1320.5, "cx": 652.25, "cy": 355.75}
    values |= dict(zip(("k1", "k2", "p1", "p2"), BROWN, strict=True))
    values |= dict.fromkeys(("k3", "k4", "k5", "k6", "s1", "tauX", "tauY"), 0.0)
    parameters = {k: {"state": 0, "val": v} for k, v in (values | changes).items()}
    size = {"imageSize": {"width": 1280, "height": 720}}
    data = {"CameraModelCRT": {"CameraModelBase": size}, "parameters": parameters}
    model = {
        "polymorphic_id": 2147483649,
        "polymorphic_name": "libCalib::CameraModelOpenCV",
        "ptr_wrapper": {"valid": 1, "data": data},
    }
    camera = {"model": model, "transform": {"rotation": {"rx": 0}}}
    return {"Calibration": {"cereal_class_version": 0, "cameras": [camera]}}


SIZE_NAMED = {"width": 1280, "height": 720}
CALIB_IO_SIZE = '"imageHeight": 720, "imageWidth": 1280'
FLAT = [each for row in MATRIX for each in row]
PHOTONVISION: dict[str, Any] = {
    "resolution": {"width": 1280.0, "height": 720.0},
    "cameraIntrinsics": {"rows": 3, "cols": 3, "type": 6, "data": FLAT},
    "distCoeffs": {"rows": 1, "cols": 5, "type": 6, "data": [*BROWN, 0.0]},
    "calobjectWarp": [0.0, 0.0],
    "observations": [{"reprojectionErrors": [{"x": 0.1, "y": 0.2}]}],
}
REALSENSE: dict[str, Any] = {
    **dict(zip(("fx", "fy", "ppx", "ppy"), PINHOLE, strict=True)),
    "width": 1280,
    "height": 720,
    "model": "distortion.brown_conrady",
    "coeffs": [*BROWN, 0.0],
}
CAMODOCAL = """%YAML:1.0
---
model_type: PINHOLE
camera_name: cam0
image_width: 1280
image_height: 720
distortion_parameters:
   k1: -0.21
   k2: 0.09
   p1: 0.0007
   p2: -0.0004
projection_parameters:
   fx: 1320.5
   fy: 1318.25
   cx: 652.25
   cy: 355.75
"""


def read(folder: Path, text: str | dict[str, Any] | list[Any]) -> Camera:
    path = folder / "camera.file"
    path.write_text(text if isinstance(text, str) else json.dumps(text), "utf-8")
    return read_camera(path)


def refusal(folder: Path, text: str | dict[str, Any]) -> str:
    with pytest.raises(FileError) as info:
        read(folder, text)
    return str(info.value)


def without(layout: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in layout.items() if name != key}


NERFSTUDIO: dict[str, Any] = {
    "w": 1280,
    "h": 720,
    "fl_x": 1320.5,
    "fl_y": 1318.25,
    "cx": 652.75,
    "cy": 356.25,
    **dict(zip(("k1", "k2", "p1", "p2"), BROWN, strict=True)),
    "camera_model": "OPENCV",
    "frames": [],
}
ORB_SLAM = f"""%YAML:1.0
Camera.type: "PinHole"
Camera1.fx: 1320.5
Camera1.fy: 1318.25
Camera1.cx: 652.25
Camera1.cy: 355.75
Camera1.k1: {BROWN[0]}
Camera1.k2: {BROWN[1]}
Camera1.p1: {BROWN[2]}
Camera1.p2: {BROWN[3]}
Camera.width: 1280
Camera.height: 720
"""
PLAIN: dict[str, Any] = {
    "width": 1280,
    "height": 720,
    **dict(zip(("fx", "fy", "cx", "cy"), PINHOLE, strict=True)),
    **dict(zip(("k1", "k2", "p1", "p2"), BROWN, strict=True)),
}
SVO = f"""label: "a"
cameras:
- camera:
    image_height: 720
    image_width: 1280
    type: pinhole
    intrinsics:
      cols: 1
      rows: 4
      data: {[*PINHOLE]}
    distortion:
      type: radial-tangential
      parameters:
        cols: 1
        rows: 4
        data: {[*BROWN]}
"""
NUMBERS = dict(
    zip(["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"], PINHOLE + BROWN, strict=True)
)
BASALT = {
    "value0": {
        "T_imu_cam": [{"px": 0}],
        "intrinsics": [
            {
                "camera_type": "pinhole-radtan8",
                "intrinsics": NUMBERS | {"k3": 0, "k4": 0, "rpmax": 2.7},
            }
        ],
        "resolution": [[*SIZE]],
    }
}
ZIVID = f"""__version__: 1
image_width: 1280
image_height: 720
CameraIntrinsics:
  CameraMatrix: {{CX: 652.25, CY: 355.75, FX: 1320.5, FY: 1318.25}}
  Distortion: {{K1: {BROWN[0]}, K2: {BROWN[1]}, K3: 0, P1: {BROWN[2]}, P2: {BROWN[3]}}}
"""
GYROFLOW: dict[str, Any] = {
    "calib_dimension": {"w": 1280, "h": 720},
    "fisheye_params": {"camera_matrix": MATRIX, "distortion_coeffs": [*FISHEYE]},
}


FOUR = dict(zip(("fx", "fy", "cx", "cy"), PINHOLE, strict=True))


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(CALISCOPE, id="caliscope"),
        pytest.param(CALISCOPE_NOW, id="caliscope array"),
        pytest.param(ANIPOSE, id="anipose"),
        pytest.param(MRCAL, id="mrcal"),
        pytest.param(MRCAL.split("\n", 1)[1], id="mrcal without comment"),
        pytest.param(
            MRCAL.replace("mk;8K", "mk;M1=K"), id="mrcal by chance like a pair"
        ),
        pytest.param(MRCAL.replace("0., 0., 0., 0.,]", "]"), id="mrcal OPENCV4"),
        pytest.param(COLMAP, id="COLMAP"),
        pytest.param(COLMAP.replace("# ", ""), id="COLMAP without marks of comments"),
        pytest.param(METASHAPE, id="Metashape"),
        pytest.param(
            METASHAPE.replace("<b1>", "<b2>0.02</b2><b1>"),
            id="Metashape, a little skew",
        ),
        pytest.param(calib_io(), id="calib.io"),
        pytest.param(
            json.dumps(calib_io(skew=0))
            .replace('"imageSize": {"width": 1280, "height": 720}', CALIB_IO_SIZE)
            .replace("ModelOpenCV", "ModelMatlab"),
            id="calib.io before version 2",
        ),
        pytest.param(PHOTONVISION, id="PhotonVision"),
        pytest.param(
            without(PHOTONVISION, "distCoeffs")
            | {"cameraExtrinsics": PHOTONVISION["distCoeffs"]},
            id="PhotonVision before 2024",
        ),
        pytest.param({"FOV": 70, "calibrations": [PHOTONVISION]}, id="its settings"),
        pytest.param(REALSENSE, id="RealSense"),
        pytest.param(CAMODOCAL, id="camodocal"),
        pytest.param(NERFSTUDIO, id="Nerfstudio"),
        pytest.param(ORB_SLAM, id="ORB-SLAM"),
        pytest.param(ORB_SLAM.replace("Camera1.", "Camera."), id="ORB-SLAM 2"),
        pytest.param(ORB_SLAM + "Viewer.PointSize:2\n", id="ORB-SLAM with its viewer"),
        pytest.param(ZIVID, id="Zivid"),
        pytest.param(SVO, id="SVO"),
        pytest.param(BASALT, id="Basalt"),
        pytest.param(
            {"camera_res": SIZE, "cameraMatrix": MATRIX, "distortion": [BROWN]},
            id="resolution of a camera",
        ),
        pytest.param(
            {"w": 1280, "h": 720, "K": [*zip(*MATRIX, strict=True)], "D": BROWN},
            id="by columns",
        ),
        pytest.param(PLAIN, id="names alone"),
        pytest.param({"camera": PLAIN}, id="within a name"),
        pytest.param({"calibration": PLAIN}, id="within a name of calib.io"),
        pytest.param(
            ANIPOSE.replace("[cam_0]", "[int_cam01_img]"), id="anipose of Pose2Sim"
        ),
        pytest.param([{"camera": PLAIN}], id="within a list"),
        pytest.param(
            {"cameras": [{"resolution": SIZE, "K": MATRIX, "distCoef": BROWN}]},
            id="a list of cameras with one",
        ),
        pytest.param(
            {"image_size": SIZE, "a": {"K": MATRIX, "dist": BROWN}, "rms": 0.2},
            id="the size beside the camera",
        ),
        pytest.param(
            {
                "cameraMatrix": dict(
                    zip(("fx", "fy", "cx", "cy"), PINHOLE, strict=True)
                ),
                "distortionCoefficients": NUMBERS,
                "imageSize": SIZE_NAMED,
            },
            id="names below names",
        ),
        pytest.param(
            {"camera_resolution": SIZE, "camera_matrix": MATRIX, "dist_coeffs": BROWN},
            id="size of interactive calibration",
        ),
        pytest.param(
            {
                "cameras": [
                    {
                        "image_dimension": SIZE,
                        "distortion_coefficients": BROWN,
                        "distortion_type": "radialtangential",
                        "focal_length": PINHOLE[:2],
                        "principal_point": PINHOLE[2:],
                    }
                ]
            },
            id="OKVIS",
        ),
        pytest.param(
            f"{{'K': {MATRIX}, 'dist': {[*BROWN]}, 'size': {SIZE}}}\n", id="Python"
        ),
        pytest.param(
            {"Camera": {"model": "perspective", "cols": 1280, "rows": 720} | NUMBERS},
            id="stella_vslam",
        ),
        pytest.param(
            dict(zip(("fx", "fy", "cx", "cy"), PINHOLE, strict=True))
            | {"width": 1280, "height": 720, "dist": BROWN},
            id="names and a list of coefficients",
        ),
        pytest.param(
            dict(zip(("fx", "fy", "cx", "cy"), PINHOLE, strict=True))
            | {"image_size": SIZE, "radial_distortion": BROWN[:2]}
            | {"tangential_distortion": BROWN[2:]},
            id="radial and tangential coefficients",
        ),
        pytest.param(
            FOUR | {"size": SIZE, "k": [*BROWN[:2], 0], "p": BROWN[2:]}, id="k and p"
        ),
        pytest.param(
            FOUR | {"image_size": SIZE, "kc": [*BROWN, 0]}, id="kc of Bouguet"
        ),
        pytest.param(
            {"resolution": SIZE_NAMED, "fps": 30}
            | {"left_camera": FOUR | {"disto": [*BROWN, 0], "v_fov": 24.9}},
            id="ZED",
        ),
        pytest.param(
            {"focal_length": PINHOLE[0], "pixel_aspect_ratio": PINHOLE[1] / PINHOLE[0]}
            | {"principal_point": [PINHOLE[2] + 0.5, PINHOLE[3] + 0.5], "skew": 0.0}
            | {"radial_distortion": [*BROWN[:2], 0], "tangential": BROWN[2:]}
            | {"image_size": SIZE, "position": [0, 0, 0]},
            id="Nerfies",
        ),
        pytest.param(
            {"stream": without(REALSENSE, "coeffs") | {"distortion": NUMBERS}},
            id="RealSense with coefficients by names",
        ),
        pytest.param(
            {"cameras": {"cam0": {"K": MATRIX, "dist": BROWN, "image_size": SIZE}}},
            id="within names of SVO and Kalibr",
        ),
        pytest.param(
            {"mtx": MATRIX, "dist_coeff": [BROWN], "img_size": SIZE_NAMED},
            id="size by names",
        ),
        pytest.param(
            {"mtx": MATRIX, "dist": BROWN, "ImageSize": {"Width": 1280, "Height": 720}},
            id="size by capitalised names",
        ),
    ],
)
def test_one_camera_is_the_same_in_all_layouts(
    tmp_path: Path, text: str | dict[str, Any]
) -> None:
    found = read(tmp_path, text)

    assert found.image_size == SIZE
    expected = [*PINHOLE, *BROWN, 0.0]
    np.testing.assert_allclose(found.intrinsics, expected, rtol=1e-14)
    assert found.lens is LensModel.BROWN


@pytest.mark.parametrize(
    "text",
    [
        CALISCOPE.replace("port = 0", "fisheye = true").replace(
            str([*BROWN, 0.0]), str([*FISHEYE])
        ),
        CALISCOPE.replace("port = 0", "fisheye_model = 1").replace(
            str([*BROWN, 0.0]), str([*FISHEYE])
        ),
        f"1 OPENCV_FISHEYE 1280 720 1320.5 1318.25 652.75 356.25 "
        f"{' '.join(map(str, FISHEYE))}\n",
        METASHAPE.replace("frame", "fisheye")
        .replace("-0.21", "-0.02")
        .replace("0.09", "0.01")
        .replace("<p1>-0.0004</p1>", "<k3>-0.006</k3>")
        .replace("<p2>0.0007</p2>", "<k4>0.001</k4>"),
        REALSENSE | {"model": "Kannala Brandt4", "coeffs": [*FISHEYE, 0]},
        GYROFLOW,
    ],
    ids=["caliscope", "OpenCV", "COLMAP", "Metashape", "RealSense", "Gyroflow"],
)
def test_a_fisheye_is_read(tmp_path: Path, text: str | dict[str, Any]) -> None:
    found = read(tmp_path, text)

    assert found.lens is LensModel.KANNALA_BRANDT
    np.testing.assert_allclose(found.intrinsics, [*PINHOLE, *FISHEYE], rtol=1e-14)


@pytest.mark.parametrize(
    ("line", "intrinsics"),
    [  # the first two of the documentation of COLMAP
        ("SIMPLE_PINHOLE 3072 2304 2559.81 1536 1152", (2559.81, 2559.81, 0, 0)),
        (
            "SIMPLE_RADIAL 3072 2304 2559.69 1536 1152 -0.0218531",
            (2559.69, 2559.69, -0.0218531, 0),
        ),
        ("RADIAL 3072 2304 2500 1536 1152 -0.1 0.02", (2500, 2500, -0.1, 0.02)),
    ],
)
def test_the_first_pixel_of_colmap_is_at_a_half(
    tmp_path: Path, line: str, intrinsics: tuple[float, ...]
) -> None:
    found = read(tmp_path, f"# of COLMAP\n7 {line}\n")

    fx, fy, k1, k2 = intrinsics
    expected = [fx, fy, 1535.5, 1151.5, k1, k2, 0, 0, 0]
    np.testing.assert_allclose(found.intrinsics, expected, rtol=1e-15)


def test_metashape_projects_as_its_manual_says(tmp_path: Path) -> None:
    found = read(tmp_path, METASHAPE.replace("<k2>", "<k3>-0.03</k3><k2>"))
    X, Y, Z = 0.21, -0.14, 1.0
    x, y = X / Z, Y / Z
    r2 = x * x + y * y
    radial = 1 - 0.21 * r2 + 0.09 * r2**2 - 0.03 * r2**3
    p1, p2 = -0.0004, 0.0007
    xd = x * radial + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y
    yd = y * radial + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y
    # from the corner of the image, not from the centre of the first pixel
    u = 1280 / 2 + 12.75 + xd * 1318.25 + xd * 2.25
    v = 720 / 2 - 3.75 + yd * 1318.25

    pixel = found.project(np.array([X, Y, Z]))

    np.testing.assert_allclose(pixel, [u - 0.5, v - 0.5], rtol=1e-13)


def test_metashape_leaves_out_a_principal_point_in_the_middle(tmp_path: Path) -> None:
    text = METASHAPE.replace("  <cx>12.75</cx>\n", "")

    assert read(tmp_path, text).cx == 640 - 0.5


def test_rational_coefficients_are_kept(tmp_path: Path) -> None:
    eight = (-0.0127, 0.0359, -0.000255, 0.000528, 0.0197, 0.0148, -0.0562, 0.05)
    found = read(
        tmp_path,
        {"lensmodel": "LENSMODEL_OPENCV8", "imagersize": [4000, 2200]}
        | {"intrinsics": [1761.18, 1761.25, 1965.71, 1087.52, *eight]},
    )
    np.testing.assert_allclose(found.distortion, eight, rtol=1e-15)


def test_a_realsense_without_distortion_is_read_whatever_its_model(
    tmp_path: Path,
) -> None:
    inverse = REALSENSE | {"model": "Inverse Brown Conrady"}

    found = read(tmp_path, inverse | {"coeffs": [0.0] * 5})

    np.testing.assert_array_equal(found.distortion, 0.0)
    assert "Inverse Brown Conrady" in refusal(tmp_path, inverse)


def test_lists_that_are_no_distortion_leave_a_camera_without(tmp_path: Path) -> None:
    others = {
        "quaternion": [0.5, -0.5, 0.5, -0.5],
        "q": [0.9238795, 0.0, 0.3826834, 0.0],
        "P": [1320.5, 0, 652.75, 0.1, 0, 1318.25, 356.25, 0, 0, 0, 1, 0],
        "pose": [0.8, 0, 0.6, 0.25, 0, 1, 0, 0.5, -0.6, 0, 0.8, 12.5],
        "covariance": np.diag([0.25, 0.25, 0.16, 0.16]).tolist(),
        "T": [0.12, 0.0, 0.03],
        "roi": [0, 0, 1280, 720],
        "window": [100.5, 20.5, 640.25, 480.25],
        "stereo": {"R": {"data": [1, 0, 0, 0, 1, 0, 0, 0, 1]}},
        "zeros": [0.0] * 5,
    }

    found = read(tmp_path, FOUR | {"image_size": SIZE} | others)

    np.testing.assert_array_equal(found.intrinsics, [*PINHOLE, 0, 0, 0, 0, 0])


def test_open3d_writes_its_matrix_by_columns(tmp_path: Path) -> None:
    columns = np.transpose(MATRIX).ravel().tolist()

    found = read(tmp_path, {"width": 1280, "height": 720, "intrinsic_matrix": columns})

    np.testing.assert_array_equal(found.intrinsics, [*PINHOLE, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ({"camera": {"f": 12}, "lens": 3}, "entries camera, lens, and no camera_matri"),
        (PLAIN | {"model": "division"}, '"division"'),
        ("cam0 (/cam0/image_raw):\n  type: <class 'aslam_cv.Distorted'>\n", "Kalibr"),
        ("  cameraParameters with properties:\n\n  Intrinsics\n  K: [3x3]", "MATLAB"),
        ({"sfm_data_version": "0.3", "intrinsics": []}, "OpenMVG"),
        ({"intrinsics": [{"pxFocalLength": "4640"}]}, "Meshroom"),
        ({"CalibrationInformation": {"Cameras": []}}, "Azure Kinect"),
        ("# Bundle file v0.3\n1 1\n4640 -0.08 0.1\n", "Bundler"),
        ("<calibration type='regular' qtm-version='2022.1'></calibration>", "Qualisys"),
        ("<Cameras><Camera ACTIVE='1' DEVICEID='2'/></Cameras>", "Vicon"),
        ("<x:xmpmeta xmlns:x='adobe:ns:meta/'></x:xmpmeta>", "RealityCapture"),
        ("ParGroup: Camera: Parameter;\n\nFocus:foc: 0.016;\n", "Halcon"),
        ({"camera": "area_scan_polynomial", "focus": 0.016}, "Halcon"),
        ("NVM_V3 \n\n2\na.jpg 4640 1 0 0 0 0 0 0 -0.08 0\n", "VisualSFM"),
        ("RadTan 464 464 123 101 -.1 .1 0 0\n244 204\ncrop\n2 2\n", "DSO"),
        ("[CAMERA_PARAMS]\nresolution=[640 480]\ncx=320\n", "MRPT"),
        ("P0: 718.8 0 607.1 0 0 718.8 185.2 0 0 0 1 0\n", "KITTI"),
        ("<ExportAPERO><F>1127</F></ExportAPERO>", "MicMac"),
        ("cam0_calib: cam0_mei.yaml\n", "choose that of the camera"),
        ("<!DOCTYPE html>\n<html><body>404</body></html>", "a web page"),
        ("version https://git-lfs.github.com/spec/v1\n", "Git LFS"),
        ({"v2 brown": {"projection_type": "brown", "focal_x": 0.7}}, "OpenSfM"),
        ({"boardName": "OAK-D", "cameraData": []}, "DepthAI (OAK-D)"),
        ("#polynomial coefficients for the DIRECT mapping function\n\n5 -46", "OCam"),
        ("Dimensions = 9 9\nModel = CAHVOR = perspective, distortion\n", "CAHVOR"),
        ("Pix4D camera calibration file 0\n#Focal\nF 16.0\n", "Pix4D"),
        ("[LEFT_CAM_2K]\nfx=1400\nfy=1400\n", "ZED"),
        ("<document version='1.2.0'>\n<chunk label='a'></chunk></document>", "project"),
        (METASHAPE.replace("f>", "fx>"), "PhotoScan"),
        ("[ 640x480  p[318 241]  f[615 615]  Brown Conrady [0 0 0 0 0] ]", "RealSense"),
        ("# oST version 5.0\n[image]\nwidth\n640\n\n[narrow_stereo]\n", "ost.txt"),
        ("{'mtx': array([[615., 0., 318.], [0., 615., 241.]])}", "Python (display)"),
        (f"%YAML:1.0\n---\nM1: {MATRIX}\nM2: {MATRIX}\n", "a stereo pair"),
        (CAMODOCAL.replace("PINHOLE", "scaramuzza"), "Scaramuzza"),
        ("[cam_0]\nsize = [640, 480]\nrotation_count = 0\n", "no camera_matrix"),
        (CAMODOCAL.replace("PINHOLE", "MEI"), '"MEI"'),
        (f"image_width: 9\nimage_height: 9\nxi: 1.2\nK: {MATRIX}\n", "omnidirect"),
        (MRCAL.replace("OPENCV8", "SPLINED_STEREOGRAPHIC_order=3"), "SPLINED"),
        (COLMAP.replace("OPENCV", "THIN_PRISM_FISHEYE"), "THIN_PRISM_FISHEYE"),
        (METASHAPE.replace("frame", "spherical"), "spherical"),
        (METASHAPE.replace("<k2>", "<k4>0.2</k4><k2>"), "thin prism or a tilted"),
        (METASHAPE.replace("<b1>2.25</b1>", "<b2>0.3</b2>"), "skew of 0.3 px"),
        (json.dumps(calib_io(tauX=0.1)), "thin prism or a tilted sensor"),
        ("p = cameraParameters('K', [1 0 0], 'ImageSize', [9 9]);", "MATLAB"),
        ({"CameraParameters1": {}, "CameraParameters2": {}}, "a stereo pair"),
        (f"<o><M1 type_id='opencv-matrix'>{MATRIX}</M1></o>", "a stereo pair"),
        ({"cameraMatrixL": MATRIX, "cameraMatrixR": MATRIX}, "a stereo pair"),
        ({"K_left": MATRIX, "K_right": MATRIX}, "a stereo pair"),
        ("Camera: {fx: 435}\nStereoRectifier:\n  model: fisheye\n", "a stereo pair"),
        ("calib_time: 09-Jan-2012\nK_00: 984 0 690 0 980 233 0 0 1\n", "KITTI"),
        ("%YAML:1.0\nnames:\n  - '1'\nK_1: !!opencv-matrix\n", "EasyMocap"),
        ("[ImageReader]\ncamera_model=OPENCV\ncamera_params=1,1,0\n", "COLMAP"),
        ({"list": [{"cameras": [{"camera_params": [1, 2, 3]}]}]}, "COLMAP"),
        ({"lensDistortionLookupTable": [0, 0.1], "pixelSize": 0.001}, "Apple"),
        ({"intrinsic_type": "DIVISION_UNDISTORTION"}, "OpenCameraCalibrator"),
        ("<OpticalProperties version='1.0'><Id>0</Id></OpticalProperties>", "Context"),
        ("<BlocksExchange version='3.2'></BlocksExchange>", "ContextCapture"),
        ("['area_scan_division', 0.016, -450, 3.45e-06]", "Halcon"),
        ("Camera: a\n C    16.002  mm\n XP    -0.012  mm\n", "Australis"),
        ("<root><!-- vpCameraParameters --><camera/></root>", "ViSP"),
        ("Left:\n('D = ', [-0.3])\n('K = ', [1512.1])\n", "ROS"),
        ("[Versions]\nueye_api_64.dll=4.95.0000\n", "It holds no intrinsics"),
        ("[Lens]\nNumber=3\nMaker=Acme\nFocus=16.0\n", "INI"),
        ({"camera_angle_x": 0.5, "mtx": MATRIX, "dist": BROWN}, "image size"),
        ({"camera_angle_x": 0.5, "frames": []}, "It holds no intrinsics"),
        ("# {05D8C294-F295-4DFB-9D01-096BD04049F4}\nWidth\t9\n", "GenICam"),
        ("1 4638.2 2448 2048 1219.6 1031.3 1 -0.08 0.1 0 0 0\n", "Argus"),
        (11 * "3.4e-01,8.2e-01\n", "DLT"),
        ("% Focal Length:   fc = [ 2603.9 2603.6 ] +/- [ 17 16 ]\n", "Bouguet"),
        ({"aux-param-autoexposure-setpoint": "1536"}, "It holds no intrinsics"),
        ("<c><image width='9'/><intrinsics fx='9' fy='9'/></c>", "XML with attributes"),
        ('// mine\n{"image_width": 9}\n', "JSON with comments"),
        ("Project: a\nFocal length: [ 4640.0 4635.5 ] +/- [ 1 1 ]\n", "GML"),
        ({"cameraMatrix": MATRIX, "D": BROWN, "projection": FLAT}, "image size"),
        ("<PlusConfiguration><Data>1</Data></PlusConfiguration>", "the entries Data"),
        ({"w": 1280, "h": 720, "K": MATRIX}, "does not state the distortion"),
        ({**REALSENSE, "coeffs": [], "dist": {"a": 1}}, "not state the distortion"),
        ({**REALSENSE, "coeffs": [], "lens_distortion": [1]}, "not state the distort"),
        (FOUR | {"size": SIZE, "lens": [*BROWN, 0.0]}, "does not state the distortion"),
        (FOUR | {"size": SIZE, "a": {"b": BROWN}}, "does not state the distortion"),
        (FOUR | {"size": SIZE, "lens": NUMBERS}, "does not state the distortion"),
        ("# oST version 5.0\n[narrow_stereo]\n", "ost.yaml"),
        ("cam0:\n  reprojection error: [0, 0] +- [0.1, 0.1]\n", "camchain"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path: Path, text: str, named: str) -> None:
    assert named in refusal(tmp_path, text)


@pytest.mark.parametrize(
    ("data", "named"),
    [
        (b"MATLAB 5.0 MAT-file, Platform: GLNXA64" + bytes(200), "jsonencode"),
        (b"\x93NUMPY\x01\x00v\x00{'descr': '<f8'}" + bytes(80), "cv2.FileStorage"),
        (b"\x89HDF\r\n\x1a\n" + bytes(80), "HDF5"),
        (b"\1" + bytes(7) + b"\1\0\0\0\4" + bytes(43), "COLMAP.*model_converter"),
        (b"\x80\x04\x95\x10\x00\x00\x00\x00\x00\x00\x00}\x94(", "pickle"),
    ],
)
def test_a_binary_file_is_named(tmp_path: Path, data: bytes, named: str) -> None:
    path = tmp_path / "camera.bin"
    path.write_bytes(data)

    with pytest.raises(FileError, match=named):
        read_camera(path)


@pytest.mark.parametrize(
    "text",
    [
        CALISCOPE + CALISCOPE.replace("cam_0", "cam_1"),
        COLMAP + "2 PINHOLE 1280 720 1320.5 1318.25 652.75 356.25\n",
        {"Calibration": {"cameras": calib_io()["Calibration"]["cameras"] * 2}},
        {"size": SIZE, "left": {"K": MATRIX, "D": BROWN}, "right": {"K": MATRIX}},
    ],
    ids=["caliscope", "COLMAP", "calib.io", "by names"],
)
def test_several_cameras_are_counted(
    tmp_path: Path, text: str | dict[str, Any]
) -> None:
    assert "describes 2 cameras" in refusal(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            CALISCOPE.replace("size = [1280, 720]", "size = [1280, 720"),
            "not valid TOML",
        ),
        ("a = " + "[" * 5000 + "]" * 5000 + "\n", "a = |nest|deep|not valid"),
        (COLMAP.replace(" -0.0004", ""), "7 parameters of the model OPENCV"),
        (without(PHOTONVISION, "resolution"), "does not state the image size"),
        (without(REALSENSE, "fx"), "no f"),
        (without(NERFSTUDIO, "cx"), "no cx"),
        (MRCAL.replace("0., 0., 0., 0.,]", "1, " * 20 + "]"), "numbers where 18"),
    ],
)
def test_a_flaw_is_named(
    tmp_path: Path, text: str | dict[str, Any], sentence: str
) -> None:
    path = tmp_path / "camera.file"
    path.write_text(text if isinstance(text, str) else json.dumps(text), "utf-8")
    with pytest.raises(FileError, match=sentence):
        read_camera(path)


def ros(*lines: str) -> str:
    return "\n".join(
        [
            "image_width: 2448",
            "image_height: 2048",
            "distortion_model: plumb_bob",
            "camera_matrix: [4640, 0, 1231, 0, 4640, 1018, 0, 0, 1]",
            "distortion_coefficients: [-0.08, 0.1, 0.0001, -0.0002, 0]",
            *lines,
        ]
    )


def bins(image: FloatArray) -> FloatArray:
    """Return an image of half as many rows and columns."""
    return np.asarray(image.reshape(len(image) // 2, 2, -1, 2).mean(axis=(1, 3)))


def test_binning_and_region_of_ros_are_applied(tmp_path: Path) -> None:
    roi = "roi: {x_offset: 200, y_offset: 100, width: 1600, height: 1200}"
    found = read(tmp_path, ros("binning_x: 2", "binning_y: 2", roi))
    whole = read(tmp_path, ros())

    point = np.array([10.0, -20.0, 300.0])
    # A light spot on the sensor, and what the driver makes of it.
    v, u = np.mgrid[:2048, :2448]
    x, y = whole.project(point)
    sensor = np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * 9.0**2))
    image = bins(sensor[100:1300, 200:1800])
    v, u = np.mgrid[: len(image), : image.shape[1]]
    centre = [np.sum(u * image), np.sum(v * image)] / image.sum()

    assert found.image_size == (800, 600)
    np.testing.assert_allclose(found.project(point), centre, atol=1e-6)


def test_the_distortion_of_euroc_is_that_of_radtan(tmp_path: Path) -> None:
    renamed = ros().replace("plumb_bob", "radial-tangential")

    found, expected = read(tmp_path, renamed), read(tmp_path, ros())

    np.testing.assert_array_equal(found.intrinsics, expected.intrinsics)


def test_a_file_is_written_for_binned_and_cropped_images(tmp_path: Path) -> None:
    driver = "roi: {x_offset: 200, y_offset: 100, width: 1600, height: 1200}"
    expected = read(tmp_path, ros("binning_x: 2", "binning_y: 2", driver))
    (tmp_path / "cam.yaml").write_text(ros())

    written = write_window(tmp_path / "cam.yaml", 2, (200, 100, 1600, 1200))

    assert written == tmp_path / "cam-200-100-1600-1200-binned-2.yaml"
    found = read_camera(written)
    assert found.image_size == expected.image_size
    np.testing.assert_array_equal(found.intrinsics, expected.intrinsics)
    with pytest.raises(FileError, match="have no region 2000 0 1600 1200"):
        write_window(tmp_path / "cam.yaml", 1, (2000, 0, 1600, 1200))


def test_the_covariance_is_that_of_the_binned_images(tmp_path: Path) -> None:
    camera = replace(
        read(tmp_path, ros()),
        covariance=np.diag(np.arange(1.0, 10.0)),
        lens_field=LensField.of(2448, 2048, 0.02, 700.0),
    )
    binned = camera.binned(2, 2)

    assert binned.covariance is not None
    np.testing.assert_array_equal(
        np.diag(binned.covariance), [0.25, 0.5, 0.75, 1, 5, 6, 7, 8, 9]
    )
    assert binned.lens_field is not None
    assert (binned.lens_field.amplitude, binned.lens_field.length) == (0.01, 350.0)


def test_ros_without_binning_is_the_whole_sensor(tmp_path: Path) -> None:
    roi = "roi: {x_offset: 0, y_offset: 0, width: 0, height: 0, do_rectify: false}"
    found = read(tmp_path, ros("binning_x: 0", "binning_y: 1", roi))
    assert found.image_size == (2448, 2048)


@pytest.mark.parametrize(
    "line",
    [
        "roi: {x_offset: 2000, y_offset: 0, width: 1600, height: 1200}",
        "binning_x: 5000",
    ],
)
def test_a_region_outside_the_sensor_is_refused(tmp_path: Path, line: str) -> None:
    assert "images of 2448 x 2048 px, which have no region" in refusal(
        tmp_path, ros(line)
    )
