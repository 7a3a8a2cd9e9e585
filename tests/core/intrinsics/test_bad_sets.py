"""Tests of sets of views that no single camera took, or that say little."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from benchmarks import board_trials

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics import alternatives, calibration
from lightpen.intrinsics.boards import parse_board
from lightpen.intrinsics.calibration import CameraCalibration, calibrate_camera
from lightpen.intrinsics.camera_change import find_change
from lightpen.intrinsics.distortion import fit_camera
from lightpen.intrinsics.variance_components import fit_effects
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.lens_field import LensField
from lightpen.simulator.boards import simulate_board_poses

MakeViews = Callable[..., Views]
NOISE = 0.03  # px
SLOWLY = np.linspace(0.0, 0.01, 20)  # zoom
OTHER = Camera(
    *(640, 480, 870.0, 869.0, 310.0, 251.0),
    distortion=np.array([-0.15, 0.1, -5e-4, 3e-4, 0.0]),
)
ONE = Camera(
    *(640, 360, 700.0, 699.7, 325.2, 174.3),
    distortion=np.array([-0.12, 0.08, 3e-4, -2e-4, 0.02]),
)
TWO = Camera(
    *(640, 360, 730.0, 729.2, 312.2, 186.3),
    distortion=np.array([-0.16, 0.1, -3e-4, 2e-4, 0.0]),
)


def calibrated(views: Views) -> CameraCalibration:
    return calibrate_camera(views, BoardTolerances())


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


@pytest.mark.slow
def test_zoom_in_the_middle_of_a_set_is_refused_with_the_first_view_after_it(
    make_views: MakeViews, camera: Camera
) -> None:
    before = make_views(n_views=28)
    after = make_views(n_views=28, of=zoomed(camera, 1.01))

    with pytest.raises(CalibrationError, match=r"changed at view_15\.png"):
        calibrated(merged(before, after, np.arange(28) >= 14))


@pytest.mark.slow
def test_the_least_zoom_that_is_said_to_be_found_is(
    make_views: MakeViews, camera: Camera
) -> None:
    before = make_views(n_views=20)
    halves = calibrated(before).halves
    assert halves is not None
    assert halves.detectable_zoom < 0.005
    for times, is_found in ((1.2, True), (0.2, False)):
        other = zoomed(camera, 1 + times * halves.detectable_zoom)
        after = make_views(n_views=20, of=other)
        views = merged(before, after, np.arange(20) >= 10)
        fit = fit_effects(views, fit_camera(views, BoardTolerances(), camera))
        assert (find_change(fit, views.names) is not None) == is_found


@pytest.mark.slow
def test_a_small_change_is_a_finding_that_the_uncertainty_holds(
    make_views: MakeViews, camera: Camera
) -> None:
    before = make_views(n_views=24)
    after = make_views(n_views=24, of=replace(camera, cx=camera.cx + 3.0))
    found = calibrated(merged(before, after, np.arange(24) >= 12))

    assert {each.code for each in found.remarks} & {
        "intrinsics.step",
        "intrinsics.drift",
    }
    # It may be as before or as after.
    assert expanded(found)[2] > 0.8 * 3.0


@pytest.mark.slow
def test_halves_that_differ_are_a_finding(
    make_views: MakeViews, camera: Camera
) -> None:
    odd = np.arange(24) % 2 == 1
    other = make_views(n_views=24, of=zoomed(camera, 1.0015))
    found = calibrated(merged(make_views(n_views=24), other, odd))

    assert [each.code for each in found.remarks] == ["intrinsics.halves"]


@pytest.mark.slow
def test_an_unchanged_camera_is_not_said_to_have_changed(make_views: MakeViews) -> None:
    for seed in range(3):
        assert not calibrated(make_views(seed=seed)).remarks


@pytest.mark.slow
def test_two_cameras_in_one_set_are_named_as_such(make_views: MakeViews) -> None:
    odd = np.arange(20) % 3 == 1
    mixed = merged(make_views(n_views=20), make_views(n_views=20, of=OTHER), odd)

    with pytest.raises(CalibrationError, match="from two cameras") as caught:
        calibrated(mixed)
    said = str(caught.value)
    assert "13 views (view_01.png, view_03.png, view_04.png" in said
    assert "7 views (view_02.png, view_05.png, view_08.png" in said


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 77])
def test_each_image_of_two_cameras_is_named_with_its_own(seed: int) -> None:
    board, rng = parse_board("chessboard:8x6:20"), np.random.default_rng(seed)
    poses = simulate_board_poses(ONE, board, 20, rng)
    points = board.points @ np.swapaxes(poses.rotations, 1, 2)
    points += poses.translations[:, None]
    is_other = np.arange(20) % 3 == 0
    pixels = np.where(is_other[:, None, None], TWO.project(points), ONE.project(points))
    pixels += rng.normal(0, 0.005, pixels.shape)
    names = tuple(f"{v:02}" for v in range(20))

    with pytest.raises(CalibrationError, match="from two cameras") as caught:
        calibrated(Views(board, names, pixels[:, None], (ONE.image_size,)))
    one = caught.value.message.values["one"]
    assert isinstance(one, Message)
    assert one.values["names"] == "00, 03, 06, 09, 12, 15 ..."


@pytest.mark.slow
def test_two_cameras_one_after_the_other_are_not_taken_for_a_zoom(
    make_views: MakeViews,
) -> None:
    after = np.arange(20) >= 10
    mixed = merged(make_views(n_views=20), make_views(n_views=20, of=OTHER), after)

    with pytest.raises(CalibrationError, match="from two cameras") as caught:
        calibrated(mixed)
    assert "10 views (view_11.png, view_12.png" in str(caught.value)


@pytest.mark.slow
def test_two_settings_in_turns_are_not_taken_for_two_cameras(
    make_views: MakeViews, camera: Camera
) -> None:
    odd = np.arange(20) % 3 == 1
    other = make_views(n_views=20, of=zoomed(camera, 1.02))

    with pytest.raises(CalibrationError, match="two settings of zoom or focus"):
        calibrated(merged(make_views(n_views=20), other, odd))


@pytest.mark.slow
def test_a_small_zoom_in_turns_is_refused(
    make_views: MakeViews, camera: Camera
) -> None:
    odd = np.arange(24) % 2 == 1
    other = make_views(n_views=24, of=zoomed(camera, 1.004))

    with pytest.raises(CalibrationError, match="two settings of zoom or focus"):
        calibrated(merged(make_views(n_views=24), other, odd))


@pytest.mark.slow
def test_a_drift_is_refused(make_views: MakeViews, camera: Camera) -> None:
    shots = [make_views(n_views=20, of=zoomed(camera, 1 + by)).pixels for by in SLOWLY]
    pixels = np.stack([shot[v] for v, shot in enumerate(shots)])

    with pytest.raises(CalibrationError, match="drifts during the set"):
        calibrated(replace(make_views(n_views=20), pixels=pixels))


@pytest.mark.parametrize("uneven", [pytest.param(0.0, marks=pytest.mark.slow), 0.2])
def test_rotated_images_are_named_also_with_uneven_squares(
    make_views: MakeViews, camera: Camera, uneven: float
) -> None:
    off_centre = replace(camera, cx=332.0, cy=230.0)
    views = make_views(n_views=14, of=off_centre, uneven=uneven)
    pixels = views.pixels.copy()
    pixels[[2, 5, 9]] = np.array([639, 479]) - pixels[[2, 5, 9]]

    with pytest.raises(CalibrationError, match="rotated by 180") as caught:
        calibrated(replace(views, pixels=pixels))
    names = caught.value.message.values["names"]
    assert names == "view_03.png, view_06.png, view_10.png"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cx", "said"),
    [
        (313.0, "3 of 14 images are rotated by 180"),
        (318.0, "check that no image is rotated by 180"),  # near the middle, 319.5
    ],
)
def test_a_lens_field_does_not_hide_that_images_may_be_rotated(
    make_views: MakeViews, camera: Camera, cx: float, said: str
) -> None:
    off_centre = replace(camera, cx=cx, cy=cx - 81.0)
    views = make_views(n_views=14, noise=0.015, of=off_centre)
    field = LensField.of(640, 480, 0.15, 180.0)
    root = np.linalg.cholesky(field.covariance + 1e-9 * np.eye(len(field.nodes)))
    drawn = np.random.default_rng(3).normal(size=field.values.shape)
    pixels = views.pixels + replace(field, values=root @ drawn).at(views.pixels)
    pixels[[2, 5, 9]] = np.array([639, 479]) - pixels[[2, 5, 9]]

    with pytest.raises(CalibrationError, match=said):
        calibrated(replace(views, pixels=pixels))


@pytest.mark.slow
def test_sheared_images_are_not_taken_for_a_sheared_board(
    make_views: MakeViews,
) -> None:
    with pytest.raises(CalibrationError, match="not perpendicular") as caught:
        calibrated(sheared(make_views(n_views=20), 0.003))
    degrees = caught.value.message.values["degrees"]
    assert isinstance(degrees, float)
    assert np.radians(degrees) == pytest.approx(0.003, abs=BoardTolerances().squareness)


def sheared(views: Views, slope: float) -> Views:
    pixels = views.pixels.copy()
    pixels[..., 0] += slope * (pixels[..., 1] - 240)
    return replace(views, pixels=pixels)


def test_no_image_is_called_rotated_for_less_than_a_lens_may_do(
    make_views: MakeViews, camera: Camera
) -> None:
    views = sheared(make_views(n_views=8, noise=0.004), 0.0008)
    fitted = fit_camera(views, BoardTolerances(), camera)

    assert alternatives.explain(views, BoardTolerances(), fitted, None) is None


@pytest.mark.slow
def test_a_skew_that_a_lens_may_have_is_not_blamed(
    make_views: MakeViews, camera: Camera
) -> None:
    views = sheared(make_views(n_views=16), 0.0024)
    fitted = fit_camera(views, BoardTolerances(), camera)

    assert alternatives.explain(views, BoardTolerances(), fitted, None) is None


def test_all_views_may_be_tried_as_rotated(
    make_views: MakeViews, camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(alternatives, "ENOUGH", 1.5)  # each seems worth it
    views = make_views(n_views=8)
    fitted = fit_camera(views, BoardTolerances(), camera)

    assert alternatives.explain(views, BoardTolerances(), fitted, None) is None


@pytest.mark.slow
def test_a_board_in_another_unit_is_questioned(make_views: MakeViews) -> None:
    found = calibrated(make_views("chessboard:9x6:2423"))

    assert "makes a board of 19.4 m" in str(found.remarks[-1])


@pytest.mark.slow
@pytest.mark.parametrize("bend", [(12.0, 0, 8.0), (25.0, 0, 0), (0, 25.0, 0)])
def test_a_board_bent_as_none_is_refused(
    make_views: MakeViews, bend: tuple[float, float, float]
) -> None:
    with pytest.raises(CalibrationError, match="bent by"):
        calibrated(make_views(shape=np.array([0, 0, *bend])))


def before_a_field(
    seed: int, amplitude: float, other: Camera = board_trials.CAMERA
) -> tuple[Views, BoolArray]:
    """Return views before a lens with a field, some of another camera, and which."""
    camera, board = board_trials.CAMERA, parse_board(board_trials.BOARD)
    rng = np.random.default_rng([board_trials.STREAM, 5, seed])
    n_views = int(rng.integers(*board_trials.N_VIEWS, endpoint=True))
    poses = simulate_board_poses(camera, board, n_views, rng)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(board_trials, "FIELD", (amplitude, amplitude))
        field = board_trials.draw_field(rng, camera)
    true = board.points.copy()
    true[:, :2] += board_trials.draw_uneven(board, rng)
    noise = int(rng.integers(1 << 30))
    pixels = [
        board_trials.observe_points(
            each, board, true, poses, field, np.random.default_rng(noise)
        )
        for each in (camera, other)
    ]
    is_other = np.random.default_rng([4, seed]).permutation(n_views) < n_views // 2
    mixed = np.where(is_other[:, None, None], pixels[1], pixels[0])
    names = tuple(map(str, range(n_views)))
    return Views(board, names, mixed[:, None], (camera.image_size,)), is_other


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 3])
def test_a_correct_set_before_a_lens_with_a_large_field_is_accepted(seed: int) -> None:
    views, _ = before_a_field(seed, 0.25)

    assert calibrated(views).change is None


@pytest.mark.parametrize(
    ("seed", "length"),
    [pytest.param(1, (0.15, 0.5), marks=pytest.mark.slow), (3, (0.5, 0.5))],
)
def test_a_lens_field_alone_is_no_reason_to_search_for_alternatives(
    monkeypatch: pytest.MonkeyPatch, seed: int, length: tuple[float, float]
) -> None:
    monkeypatch.setattr(board_trials, "LENGTH", length)
    monkeypatch.setattr(board_trials, "NOISE", (0.01, 0.01))
    monkeypatch.setattr(board_trials, "SMOOTH", (0.0, 0.0))
    monkeypatch.setattr(calibration, "explain", lambda *_, **__: pytest.fail("slow"))
    found = calibrated(before_a_field(seed, 0.25)[0])

    assert found.effects.components.lenses[0] > 10 * found.effects.components.noise


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 12])  # taken for rotated images, and accepted
def test_two_cameras_behind_a_lens_field_are_found(seed: int) -> None:
    other = replace(board_trials.CAMERA, fx=575.0, fy=574.2, cx=197.3, cy=152.1)
    views, is_other = before_a_field(seed, 0.08, other)

    with pytest.raises(CalibrationError, match=r"two (cameras|settings)") as caught:
        calibrated(views)
    one = caught.value.message.values["one"]
    assert isinstance(one, Message)
    n_first = one.values["n_views"]
    assert min(abs(n_first - n) for n in (is_other.sum(), (~is_other).sum())) <= 1


@pytest.mark.slow
def test_a_lens_field_beside_little_noise_is_not_blamed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(board_trials, "NOISE", (0.003, 0.008))

    assert isinstance(board_trials.run_trial(8, rendered=False), board_trials.Trial)
