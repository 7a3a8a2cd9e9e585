"""What the images say against a camera file: named, let go, and never passed over."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, observe_pixels, simulate_centers
from tests.simulated_rigs import row_of_cameras

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.consistency_findings import (
    DIAMETER,
    Contradiction,
    _of_camera,
    _places,
)
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.reports.verdict import Grade, NextStep, judge
from lightpen.messages import Code
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen_extensions.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    swing_poses,
)

CAMERA = paper_camera()
PEN = replace(paper_pen(), led_sigma=0.002)
LIMITS = SwingLimits()


def drawn_covariance() -> FloatArray:
    """Return that of a poor calibration: f 0.3 %, aspect 0.03 %, centre 3 px."""
    focal = np.array([CAMERA.fx, CAMERA.fy])
    covariance = np.diag(np.square([0, 0, 3, 3, 0.02, 0.1, 3e-4, 3e-4, 0]))
    covariance[:2, :2] = np.outer(focal, focal) * 0.003**2
    covariance[1, 1] += (CAMERA.fy * 0.0003) ** 2
    return covariance


def off_by(covariance: FloatArray | None, **changes: float) -> Camera:
    """Return the camera with a relative ``focal_length``, ``cx`` or ``cy`` off."""
    intrinsics = CAMERA.intrinsics
    intrinsics[:2] *= 1 + changes.get("focal_length", 0.0)
    intrinsics[2] += changes.get("cx", 0.0)
    intrinsics[3] += changes.get("cy", 0.0)
    return replace(CAMERA.with_intrinsics(intrinsics), covariance=covariance)


def wrong_file(**changes: float) -> Camera:
    """Return one that states f to 0.1 %: ``f`` and ``aspect`` off by a share."""
    covariance = drawn_covariance()
    covariance[:2, :2] /= 9
    intrinsics = CAMERA.intrinsics
    intrinsics[:2] *= 1 + changes.get("f", 0.0)
    intrinsics[1] *= 1 + changes.get("aspect", 0.0)
    intrinsics[2:5] += [changes.get(name, 0.0) for name in ("cx", "cy", "k1")]
    return replace(CAMERA.with_intrinsics(intrinsics), covariance=covariance)


def named_numbers(camera: Camera) -> dict[str, float]:
    return {
        "focal length": 0.5 * (camera.fx + camera.fy),
        "ratio fy / fx of the focal lengths": camera.fy / camera.fx,
        "principal point cx": camera.cx,
        "principal point cy": camera.cy,
        "distortion coefficient k1": float(camera.distortion[0]),
    }


def calibrated(
    file: Camera, seed: int, n_images: int = 60
) -> tuple[Swing, Calibration]:
    """Return a swing seen by the true camera, calibrated with that of a file."""
    rng = np.random.default_rng([seed, 4])
    swing = swing_poses(n_images, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.03, rng
    )
    return swing, calibrate_pixels(pixels, file, PEN)


def names(result: Calibration) -> list[str]:
    return [str(each.what) for each in result.contradictions]


def is_beyond(swing: Swing, result: Calibration) -> bool:
    """Tell whether the tip is farther off along the weakest direction than U."""
    error = result.joint.tip_pen - swing.tip_pen
    along = abs(float(error @ result.budget.weakest_direction))
    return along > result.budget.weakest_uncertainty


@pytest.mark.slow
def test_camera_files_as_good_as_they_say_are_put_right_and_covered() -> None:
    n_runs = 24
    covariance = drawn_covariance()
    lengths, inside = [], []
    for seed in range(n_runs):
        rng = np.random.default_rng(seed)
        file = CAMERA.with_intrinsics(
            rng.multivariate_normal(CAMERA.intrinsics, covariance)
        )
        swing, result = calibrated(replace(file, covariance=covariance), seed)
        error = result.joint.tip_pen - swing.tip_pen
        lengths.append(float(np.linalg.norm(error)))
        inside.append(np.abs(error) <= result.budget.expanded_uncertainty[:3])

    assert np.median(lengths) <= 0.007
    # 95 % of 24 along each axis, less three standard deviations of 4.4 %.
    assert (np.mean(inside, axis=0) >= 0.81).all()


@pytest.mark.slow
def test_a_true_camera_file_is_hardly_ever_contradicted() -> None:
    file = replace(CAMERA, covariance=drawn_covariance())
    found = [calibrated(file, seed, 30)[1] for seed in range(10)]

    assert not any(result.contradictions for result in found)


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [{"focal_length": 0.003}, {"focal_length": 0.009}, {"cy": 3.0}, {"cy": 10.0}],
    ids=str,
)
def test_a_wrong_file_that_states_nothing_never_passes_a_tip_beyond_u(
    changes: dict[str, float],
) -> None:
    for seed in range(6):
        swing, result = calibrated(off_by(None, **changes), seed)
        passed = judge(result, LIMITS).grade is Grade.PASS
        assert not (passed and is_beyond(swing, result))


@pytest.mark.slow
def test_a_file_without_distortion_never_passes_and_is_named() -> None:
    straight = CAMERA.intrinsics
    straight[4:] = 0.0
    file = replace(CAMERA.with_intrinsics(straight), covariance=None)
    for seed in range(6):
        _, result = calibrated(file, seed)
        assert judge(result, LIMITS).grade is not Grade.PASS
        assert any("k1" in name for name in names(result))
        deviations = [each.deviations for each in result.contradictions]
        assert deviations == sorted(deviations, reverse=True)


@pytest.mark.parametrize(
    ("changes", "name"),
    [({"focal_length": 0.01}, "focal length"), ({"cy": 20.0}, "principal point cy")],
)
def test_what_lies_far_beyond_the_files_own_uncertainty_is_named_with_both_values(
    changes: dict[str, float], name: str
) -> None:
    covariance = drawn_covariance()
    covariance[:2, :2] /= 9  # f 0.1 %
    file = off_by(covariance, **changes)
    swing, result = calibrated(file, 1)

    assert name in names(result)
    found = next(each for each in result.contradictions if str(each.what) == name)
    values = {
        "focal length": [0.5 * (each.fx + each.fy) for each in (file, CAMERA)],
        "principal point cx": [file.cx, CAMERA.cx],
        "principal point cy": [file.cy, CAMERA.cy],
    }
    stated, true = values[name]
    assert found.deviations > 3
    assert found.stated == pytest.approx(stated)
    assert abs(found.estimated - true) <= 1.5 * found.estimated_uncertainty
    assert str(found.message) in map(str, warnings_of(result))
    assert f"intrinsics file: {name} " in str(found.message)
    assert "calibrate the camera again" in str(found.message)
    verdict = judge(result, SwingLimits(max_uncertainty=0.1))
    assert verdict.grade is Grade.CHECK
    assert verdict.reason.code == Code.FILE_CONTRADICTED
    assert verdict.next_step is NextStep.CHECK_CAMERA
    # What is refuted no longer pulls at the tip.
    error = np.abs(result.joint.tip_pen - swing.tip_pen)
    assert (error <= 1.5 * result.budget.expanded_uncertainty[:3]).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"f": 0.01, "aspect": 0.003},
        {"f": 0.01, "cy": 25.0},
        {"f": -0.01, "cx": -15.0, "k1": 0.15},
        {"f": 0.01, "cx": 15.0, "cy": 25.0},
    ],
    ids=str,
)
def test_several_wrong_numbers_are_reported_as_the_images_want_them_together(
    changes: dict[str, float],
) -> None:
    file = wrong_file(**changes)
    _, result = calibrated(file, 1)
    fitted = named_numbers(result.bundle.state.rig.cameras[0])
    stated, true = named_numbers(file), named_numbers(CAMERA)
    wrong = {name for name in true if abs(stated[name] - true[name]) > 1e-9}
    found = {str(each.what): each for each in result.contradictions}
    deviations = [each.deviations for each in result.contradictions]

    assert set(found) == wrong
    assert deviations == sorted(deviations, reverse=True)
    for name, each in found.items():
        assert abs(each.estimated - true[name]) <= 1.5 * each.estimated_uncertainty
        # Next to nothing of what the file says of them is left.
        assert abs(each.estimated - fitted[name]) <= 0.02 * each.estimated_uncertainty


@pytest.mark.slow
def test_noise_that_lasts_contradicts_no_true_file() -> None:
    contradicted = 0
    for seed in range(8):
        rng = np.random.default_rng([seed, 5])
        swing = swing_poses(15, rng)
        errors = rng.standard_normal((15, PEN.n_leds, 2))
        for i in range(1, 15):
            errors[i] = 0.9 * errors[i - 1] + np.sqrt(1 - 0.81) * errors[i]
        exact = simulate_centers(
            CAMERA, PEN, swing.rotations, swing.translations, 0.0, rng
        )
        pixels = exact + 0.03 * errors
        observations = observe_pixels(pixels, CAMERA, PEN)
        contradicted += bool(calibrate(CAMERA, PEN, observations).contradictions)

    assert contradicted <= 1


def test_the_camera_as_adjusted_is_nearer_to_the_truth_than_its_file() -> None:
    file = off_by(drawn_covariance(), focal_length=0.003, cy=3.0)
    _, result = calibrated(file, 2)
    fitted = result.bundle.state.rig.cameras[0]

    # 60 images know f to 0.014 % and fy / fx to 0.003 %.
    assert abs(fitted.fx / CAMERA.fx - 1) < 0.0006
    assert abs(fitted.fy / fitted.fx - CAMERA.fy / CAMERA.fx) < 0.0003
    assert not result.contradictions


def test_each_number_of_a_camera_can_be_changed_alone() -> None:
    numbers = _of_camera(CAMERA, CAMERA)

    changes = [[one.by @ other.along for other in numbers] for one in numbers]
    # The lens is round to half a thousandth.
    np.testing.assert_allclose(changes, np.eye(9), atol=1e-3)


@pytest.mark.parametrize(
    ("camera", "of_rig", "of_pen", "code"),
    [
        ("", False, True, "warning.pen-file-contradicted"),
        ("", False, False, "warning.camera-file-contradicted"),
        ("left", False, False, "warning.camera-file-contradicted"),
        ("left", True, False, "warning.rig-file-contradicted"),
    ],
)
@pytest.mark.parametrize(
    ("unit", "uncertainty", "wanted"),
    [("mm", 0.11, 10.06), ("px", 1.1, 10.1), ("", 9.9, 10.1), ("", 12.0, 10.0)],
)
def test_a_contradiction_says_what_is_wanted_and_what_is_stated(
    camera: str,
    of_rig: bool,
    of_pen: bool,
    code: str,
    unit: str,
    uncertainty: float,
    wanted: float,
) -> None:
    found = Contradiction(
        *(DIAMETER, unit, 9.0, 0.04, 10.0611, uncertainty, 18.0),
        *(camera, of_rig, of_pen),
    ).message

    assert camera in str(found)
    parts = {part.code: part for part in found.parts()}
    assert code in parts
    assert parts["warning.contradicted-numbers"].values == {
        "what": DIAMETER,
        "wanted": wanted,
        "wanted_u": uncertainty,
        "stated": 9.0,
        "stated_u": 0.04,
        "unit": f" {unit}" if unit else "",
    }


def test_a_rig_file_states_turns_and_translations_of_all_cameras_but_the_first() -> (
    None
):
    rig = row_of_cameras(3, 1000.0)
    numbers = iter(_places(rig))
    unit = np.eye(12)
    for c, first in ((1, 0), (2, 6)):
        for k in range(3):
            turn, shift = next(numbers), next(numbers)
            assert (turn.unit, turn.value, turn.camera) == ("deg", 0.0, rig.names[c])
            assert turn.size == pytest.approx(180 / np.pi)
            assert (shift.unit, shift.size, shift.camera) == ("mm", 1.0, rig.names[c])
            assert shift.value == rig.translations[c, k]
            for each, at in ((turn, first + k), (shift, first + 3 + k)):
                np.testing.assert_array_equal(each.by, unit[at])
                np.testing.assert_array_equal(each.along, unit[at])
            assert turn.what.values == shift.what.values == {"axis": "xyz"[k]}
    assert not list(numbers)
