"""Tests of sets of views that no single camera took, or that say little."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from benchmarks import board_trials

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen_extensions.boards.calibration import CameraCalibration, calibrate_camera
from lightpen_extensions.boards.observing import Views

MakeViews = Callable[..., Views]
NOISE = 0.03  # px
SLOWLY = np.linspace(0.0, 0.01, 20)  # zoom
OTHER = Camera(
    *(640, 480, 870.0, 869.0, 310.0, 251.0),
    distortion=np.array([-0.15, 0.1, -5e-4, 3e-4, 0.0]),
)


def calibrated(views: Views) -> CameraCalibration:
    return calibrate_camera(views)


def expanded(found: CameraCalibration) -> FloatArray:
    assert found.camera.covariance is not None
    return 2 * np.sqrt(np.diag(found.camera.covariance))


def merged(one: Views, other: Views, is_other: BoolArray) -> Views:
    """Return the views of one, and some in the place of them of the other."""
    which = is_other[:, None, None, None]
    return replace(one, pixels=np.where(which, other.pixels, one.pixels))


def zoomed(camera: Camera, by: float) -> Camera:
    return replace(camera, fx=by * camera.fx, fy=by * camera.fy)


@pytest.fixture(scope="module")
def ten(make_views: MakeViews) -> CameraCalibration:
    return calibrated(make_views(n_views=10))


@pytest.mark.slow
def test_views_copied_six_times_count_once(
    make_views: MakeViews, ten: CameraCalibration
) -> None:
    views = make_views(n_views=10)
    names = tuple(f"{copy}-{name}" for copy in range(6) for name in views.names)
    copied = replace(views, pixels=np.tile(views.pixels, (6, 1, 1, 1)), names=names)
    found = calibrated(copied)

    np.testing.assert_allclose(expanded(found), expanded(ten))
    assert len(found.duplicates) == 50
    assert "view_06.png ...). 10 views remain" in str(found.remarks[0])


@pytest.mark.slow
def test_images_of_a_board_at_rest_count_once(
    make_views: MakeViews, ten: CameraCalibration
) -> None:
    views = make_views(n_views=10)
    pixels = np.repeat(views.pixels, 6, axis=0)
    pixels[np.arange(60) % 6 > 0] += np.random.default_rng(1).normal(
        0, NOISE, (50, *pixels.shape[1:])
    )
    names = tuple(f"{frame}.png" for frame in range(60))
    found = calibrated(replace(views, pixels=pixels, names=names))

    np.testing.assert_allclose(expanded(found), expanded(ten))
    assert found.views.n_views == 10


def test_one_pose_alone_is_refused_as_such(make_views: MakeViews) -> None:
    views = make_views(n_views=8)
    rest = np.repeat(views.pixels[:1], 8, axis=0)

    with pytest.raises(CalibrationError, match="Different poses of the board: 1"):
        calibrated(replace(views, pixels=rest))


def codes(found: CameraCalibration) -> set[str]:
    return {remark.code for remark in found.remarks}


@pytest.mark.slow
def test_zoom_in_the_middle_of_a_set_is_refused_with_the_first_view_after_it(
    make_views: MakeViews, camera: Camera
) -> None:
    before = make_views(n_views=28)
    after = make_views(n_views=28, of=zoomed(camera, 1.01))

    with pytest.raises(CalibrationError, match=r"in 14 views \(view_15\.png"):
        calibrated(merged(before, after, np.arange(28) >= 14))


@pytest.mark.slow
def test_a_small_change_is_a_finding_that_the_uncertainty_holds(
    make_views: MakeViews, camera: Camera
) -> None:
    before = make_views(n_views=24)
    after = make_views(n_views=24, of=replace(camera, cx=camera.cx + 3.0))
    found = calibrated(merged(before, after, np.arange(24) >= 12))

    assert "intrinsics.apart" in codes(found)
    # It may be as before or as after.
    assert expanded(found)[2] > 0.8 * 3.0


@pytest.mark.slow
def test_an_unchanged_camera_is_not_said_to_have_changed(make_views: MakeViews) -> None:
    for seed in range(3):
        assert not calibrated(make_views(seed=seed)).remarks


@pytest.mark.slow
@pytest.mark.parametrize("which", [np.arange(20) % 3 == 1, np.arange(20) >= 10])
def test_two_cameras_in_one_set_are_named_as_such(
    make_views: MakeViews, which: BoolArray
) -> None:
    mixed = merged(make_views(n_views=20), make_views(n_views=20, of=OTHER), which)

    with pytest.raises(CalibrationError) as caught:
        calibrated(mixed)
    assert caught.value.message.code == "intrinsics.two-settings"
    first = tuple(np.array(mixed.names)[which])[:3]
    assert ", ".join(first) in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize("zoom", [1.015, 1.03])
def test_two_settings_in_turns_are_refused(
    make_views: MakeViews, camera: Camera, zoom: float
) -> None:
    odd = np.arange(24) % 2 == 1
    other = make_views(n_views=24, of=zoomed(camera, zoom))

    with pytest.raises(CalibrationError, match="two settings of zoom or focus"):
        calibrated(merged(make_views(n_views=24), other, odd))


@pytest.mark.slow
def test_three_views_of_another_setting_refuse_no_set(
    make_views: MakeViews, camera: Camera
) -> None:
    which = np.arange(20) < 3
    other = make_views(n_views=20, of=zoomed(camera, 1.01))
    found = calibrated(merged(make_views(n_views=20), other, which))

    off = np.abs(found.camera.intrinsics - camera.intrinsics)
    assert np.all(off[:4] < 1.5 * expanded(found)[:4])


@pytest.mark.slow
def test_a_drift_is_refused(make_views: MakeViews, camera: Camera) -> None:
    shots = [make_views(n_views=20, of=zoomed(camera, 1 + by)).pixels for by in SLOWLY]
    pixels = np.stack([shot[v] for v, shot in enumerate(shots)])

    with pytest.raises(CalibrationError, match="two settings"):
        calibrated(replace(make_views(n_views=20), pixels=pixels))


@pytest.mark.parametrize("uneven", [pytest.param(0.0, marks=pytest.mark.slow), 0.2])
def test_three_rotated_images_are_named_and_left_out(
    make_views: MakeViews, camera: Camera, uneven: float
) -> None:
    off_centre = replace(camera, cx=332.0, cy=230.0)
    found = calibrated(
        with_rotated(make_views(n_views=14, of=off_centre, uneven=uneven), [2, 5, 9])
    )

    (remark,) = (each for each in found.remarks if each.code == "intrinsics.turned")
    assert remark.values["names"] == "view_03.png, view_06.png, view_10.png"
    off = np.abs(found.camera.intrinsics - off_centre.intrinsics)
    assert np.all(off[:4] < 1.5 * expanded(found)[:4])


def test_rotated_images_are_named_though_the_principal_point_is_near_the_centre(
    make_views: MakeViews, camera: Camera
) -> None:
    near = replace(camera, cx=315.5, cy=247.5)  # 4 and 8 px off
    views = make_views(n_views=14, of=near, noise=0.006)
    found = calibrated(with_rotated(views, [2, 5, 9]))

    (remark,) = (each for each in found.remarks if each.code == "intrinsics.turned")
    assert remark.values["names"] == "view_03.png, view_06.png, view_10.png"


@pytest.mark.slow
def test_a_set_with_many_rotated_images_is_refused(
    make_views: MakeViews, camera: Camera
) -> None:
    off_centre = replace(camera, cx=332.0, cy=230.0)
    views = make_views(n_views=14, of=off_centre)

    with pytest.raises(CalibrationError, match="of 14 images are rotated by 180"):
        calibrated(with_rotated(views, [1, 2, 5, 9, 12]))


def with_rotated(views: Views, which: list[int]) -> Views:
    pixels = views.pixels.copy()
    pixels[which] = np.array(views.image_sizes[0]) - 1.0 - pixels[which]
    return replace(views, pixels=pixels)


@pytest.mark.slow
@pytest.mark.parametrize("bend", [(0.3, 0.0, 0.0), (1.0, 0.5, 0.0), (5.0, 0.0, 5.0)])
def test_a_bowed_or_curled_board_is_calibrated_with(
    make_views: MakeViews, camera: Camera, bend: tuple[float, float, float]
) -> None:
    found = calibrated(make_views(shape=np.array([0, 0, *bend]), n_views=20))

    off = np.abs(found.camera.intrinsics - camera.intrinsics)
    assert np.all(off[:4] < 1.5 * expanded(found)[:4])
    assert not codes(found)


@pytest.mark.slow
def test_no_set_as_photographed_is_said_to_be_of_two_settings() -> None:
    for seed in range(6):
        found = calibrated(board_trials.photographed(seed))
        assert "intrinsics.apart" not in codes(found)
