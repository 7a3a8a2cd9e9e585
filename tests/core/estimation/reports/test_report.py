"""The record and the text of a calibration hold all of it, and nothing unreadable."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.small_records import record_of
from tests.simulated_centers import calibrate_pixels, simulate_centers

from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.pivot_calibration import calibrate_pivot
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.reports.summary import (
    calibration_text,
    convergence_text,
    pivot_record,
    pivot_text,
)
from lightpen.estimation.reports.verdict import Verdict, judge
from lightpen.estimation.uncertainty.budget import (
    ContributionName,
    UncertaintyContribution,
)
from lightpen.formats.opened_files import InputFile, Inputs
from lightpen.formats.own_json import json_bytes
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.names import Method
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.swings import (
    Postures,
    paper_camera,
    paper_pen,
    swing_from_postures,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()
FILE = InputFile(Path("folder/file.csv"), 64 * "0")
INPUTS = Inputs(FILE, FILE, (FILE,), PEN.nominal_tip)
LIMITS = SwingLimits(max_uncertainty=0.0987, min_images=41)


@cache
def calibration() -> Calibration:
    """Return a calibration with an image of too few LEDs and one of another tip."""
    rng = np.random.default_rng(0)
    swing = swing_poses(40, rng)
    translations = swing.translations.copy()
    translations[5] += [0.5, 0, 0]
    pixels = simulate_centers(CAMERA, PEN, swing.rotations, translations, 0.02, rng)
    pixels[3, 2:] = np.nan
    pixels[:, 9] = np.nan
    return calibrate_pixels(pixels, CAMERA, PEN)


def of_camera(file: Camera, pen: Pen = PEN) -> Calibration:
    """Return a calibration of good images by files that may be wrong."""
    rng = np.random.default_rng(3)
    swing = swing_poses(40, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.02, rng
    )
    return calibrate_pixels(pixels, file, pen)


def verdict() -> Verdict:
    return judge(calibration(), LIMITS)


def record(method: Method = "joint") -> dict[str, Any]:
    found = replace(calibration(), method=method)
    written = json_bytes(calibration_record(found, INPUTS, LIMITS))

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    parsed: dict[str, Any] = json.loads(written, parse_constant=refuse)
    return parsed


def test_the_record_holds_the_tip_and_its_uncertainty() -> None:
    found = record()
    joint = calibration().joint

    np.testing.assert_array_equal(found["tip_pen_mm"], joint.tip_pen)
    np.testing.assert_array_equal(found["cone_cam_mm"], joint.cone_cam)
    assert np.shape(found["covariance"]) == (6, 6)
    np.testing.assert_allclose(
        found["expanded_uncertainty_mm"], 2 * np.sqrt(np.diag(found["covariance"]))[:3]
    )
    np.testing.assert_allclose(
        found["cone_expanded_uncertainty_mm"],
        2 * np.sqrt(np.diag(found["covariance"]))[3:],
    )
    np.testing.assert_allclose(
        found["change_from_nominal_mm"], joint.tip_pen - [0, -90, -25]
    )


@pytest.mark.parametrize(
    "lost",
    [
        {"projection_bias": np.full(6, np.nan)},
        {"tips_cam": np.full((40, 3), np.nan)},
        {"rms": np.full(40, np.nan)},
    ],
    ids=lambda lost: next(iter(lost)),
)
def test_a_figure_that_could_not_be_found_leaves_the_record_readable(
    lost: dict[str, Any],
) -> None:
    """A tip in force must not be lost by a figure beside it."""
    found = replace(calibration(), **lost)
    written = json_bytes(calibration_record(found, INPUTS, LIMITS))

    assert record_of(json.loads(written)).tip_pen_mm == tuple(found.joint.tip_pen)


def test_the_method_decides_which_result_is_given_and_both_are_there() -> None:
    found = record("two-stage")

    assert found["method"] == "two-stage"
    assert found["tip_pen_mm"] == found["methods"]["two-stage"]["tip_pen_mm"]
    assert found["tip_pen_mm"] != found["methods"]["joint"]["tip_pen_mm"]
    assert len(found["methods"]["two-stage"]["convergence"]["x_mm"][0]) == 6


def test_the_two_stage_tip_is_uncertain_by_its_difference_from_the_joint_fit() -> None:
    joint, paper = record(), record("two-stage")
    off = np.subtract(paper["tip_pen_mm"], joint["tip_pen_mm"])

    np.testing.assert_allclose(paper["methods"]["two-stage"]["off_joint_mm"], off)
    np.testing.assert_allclose(
        np.square(paper["expanded_uncertainty_mm"]),
        np.square(joint["expanded_uncertainty_mm"]) + np.square(2 * off),
    )
    tip = np.array(paper["covariance"])[:3, :3]
    stated = paper["weakest_direction"]["expanded_uncertainty_mm"]
    assert stated == pytest.approx(2 * np.sqrt(np.linalg.eigvalsh(tip)[-1]))


def test_the_convergence_is_a_table_of_the_iteration() -> None:
    fit = calibration().two_stage
    _, heading, *rows = convergence_text(fit).splitlines()

    assert heading.split()[0] == "k"
    assert len(rows) == len(fit.objectives)
    k, *X = map(float, rows[0].split())
    assert k == 0
    np.testing.assert_allclose(X[:6], fit.iterates[0], atol=1e-6)
    k, *X, alpha, increment, objective = map(float, rows[-1].split())
    assert k == len(fit.increments)
    np.testing.assert_allclose(X, fit.iterates[-1], atol=1e-6)
    assert alpha == pytest.approx(fit.step_lengths[-1], abs=1e-4)
    assert increment == pytest.approx(fit.increments[-1], rel=0.01)
    assert objective == pytest.approx(fit.objectives[-1], rel=1e-5)


def test_every_image_is_in_the_record_with_its_fate() -> None:
    frames = record()["frames"]

    assert [frame["used"] for frame in frames].count(False) == 2
    assert frames[3]["reason"] == "too few LEDs"
    assert frames[3]["rms_px"] is None
    assert frames[3]["tip_cam_mm"] == [None, None, None]
    assert frames[5]["reason"] == "tip slipped"
    assert [led["led"] for led in frames[0]["leds"]] == list(range(1, 10))
    assert all(led["used"] for led in frames[0]["leds"])
    assert not any(led["used"] for led in frames[5]["leds"])


def test_an_led_that_was_never_seen_has_no_figures() -> None:
    led = record()["leds"][9]

    assert led["seen"] == led["used"] == 0
    assert led["rms_px"] is None
    assert not led["displaced"]


def test_the_record_holds_the_verdict_and_the_limits_that_it_was_judged_by() -> None:
    assert record()["verdict"] == {
        "grade": "check",
        "code": "verdict.too-few-images",
        "text": "Images captured: 39 of 41 (minimum).",
        "values": {"n_kept": 39, "needed": 41},
        "next_step": "capture more",
        "limits": {"max_uncertainty_mm": 0.0987, "min_images": 41, "min_per_field": 2},
    }


def test_the_record_holds_each_share_of_the_uncertainty() -> None:
    found, budget = record()["uncertainty"], calibration().budget

    names = [share["name"] for share in found["shares"]]
    assert names == [share.name.value for share in budget.shares]
    assert {"noise", "disc diameter", "camera", "lens"} <= set(names)
    squares = np.sum(
        [np.square(share["standard_uncertainty_mm"]) for share in found["shares"]],
        axis=0,
    )
    np.testing.assert_allclose(
        2 * np.sqrt(squares), record()["expanded_uncertainty_mm"]
    )
    assumed = [share["name"] for share in found["shares"] if share["assumed"]]
    assert assumed == ["ball and cone"]  # no file states it
    assert np.shape(found["independent_noise_mm"]) == (3,)
    assert "rig" not in names  # one camera has none


def test_the_record_holds_what_the_images_made_of_the_camera_and_the_discs() -> None:
    found = record()["adjusted"]
    names = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]

    assert list(found["intrinsics"]) == names
    for name, true in zip(names[:8], CAMERA.intrinsics, strict=False):
        entry = found["intrinsics"][name]
        assert abs(entry["value"] - true) < 4 * entry["standard_uncertainty"]
    assert abs(found["disc_diameter_mm"] - 10) < 0.1
    assert found["contradictions"] == []


def test_what_is_assumed_is_marked_in_record_and_text() -> None:
    camera = replace(CAMERA, covariance=None)
    result = of_camera(camera)
    written = json_bytes(calibration_record(result, INPUTS, LIMITS))
    text = calibration_text(result, None, judge(result, LIMITS))

    shares = json.loads(written)["uncertainty"]["shares"]
    assumed = [share["name"] for share in shares if share["assumed"]]
    assert assumed == ["ball and cone", "camera"]
    assert "U from camera, assumed" in text
    assert text.count(", assumed") == len(assumed)


def test_the_text_tells_the_stated_discs_from_the_fitted_ones() -> None:
    vague = of_camera(CAMERA, replace(PEN, diameter=11.0, diameter_sigma=2.0))
    fitted = vague.bundle.state.pen.diameter
    assert abs(fitted - 11.0) > 0.01
    moved = f"11.00 mm wide as stated or by default, {fitted:.2f} mm as fitted; LED"
    assert moved in calibration_text(vague, None, verdict())

    text = calibration_text(calibration(), None, verdict())
    assert "10.00 mm wide as stated or by default; LED centres alone" in text


def test_a_contradicted_file_is_in_record_warnings_and_text() -> None:
    intrinsics_off = replace(CAMERA, fx=1.01 * CAMERA.fx, fy=1.01 * CAMERA.fy)
    result = of_camera(intrinsics_off)
    written = json_bytes(calibration_record(result, INPUTS, LIMITS))
    found = json.loads(written)
    text = calibration_text(result, None, judge(result, LIMITS))

    (entry,) = (
        each
        for each in found["adjusted"]["contradictions"]
        if each["what"] == "focal length"
    )
    assert entry["unit"] == "px"
    assert entry["stated"] == pytest.approx(1.01 * CAMERA.fx, rel=1e-3)
    assert entry["wanted"] == pytest.approx(CAMERA.fx, rel=1e-3)
    codes = [warning["code"] for warning in found["warnings"]]
    assert "warning.camera-file-contradicted" in codes
    assert "The images contradict the intrinsics file: focal length" in text


def test_words_among_the_values_of_a_verdict_have_codes_and_text() -> None:
    rng = np.random.default_rng(0)
    postures = Postures(
        np.radians(rng.uniform(10, 30, 60)),
        np.radians(rng.uniform(-20, 245, 60)),
        np.radians(rng.uniform(-30, 30, 60)),
    )
    swing = swing_from_postures(postures)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.02, rng
    )
    one_sided = calibrate_pixels(pixels, CAMERA, PEN)
    limits = SwingLimits(max_uncertainty=1.0)

    written = json_bytes(calibration_record(one_sided, INPUTS, limits))

    found = json.loads(written)["verdict"]
    assert found["code"] == "verdict.too-little-tilt"
    assert found["values"]["sides"] == [
        {"code": "side.towards", "text": "towards the camera", "values": {}},
        {
            "code": "side.towards-right",
            "text": "towards the camera to the right",
            "values": {},
        },
    ]


def test_the_text_ends_with_the_verdict_its_reason_and_the_next_step() -> None:
    text = calibration_text(calibration(), None, verdict())

    assert text.splitlines()[-2:] == [
        "Verdict      CHECK: Images captured: 39 of 41 (minimum).",
        "             Next: capture more images. The images of this swing are "
        "retained.",
    ]


def test_the_record_names_program_and_inputs() -> None:
    found = record()

    assert found["program"]["name"] == "lightpen"
    assert found["inputs"]["camera"] == {"file": "file.csv", "sha256": 64 * "0"}
    assert found["images"]["dropped"] == {"too few LEDs": 1, "tip slipped": 1}


@pytest.mark.parametrize("method", ["joint", "two-stage"])
def test_the_text_shows_tip_both_methods_and_what_was_dropped(method: Method) -> None:
    found = replace(calibration(), method=method)
    text = calibration_text(found, PEN.nominal_tip, verdict())
    rows = {line.split()[0]: line for line in text.splitlines() if line.strip()}

    assert f"{calibration().joint.tip_pen[1]:.4f}" in text
    assert f"{calibration().two_stage.tip_pen[1]:.4f}" in text
    assert text.index(method) <= min(text.index("joint"), text.index("two-stage"))
    assert "Images       38 of 40 used" in rows["Images"]
    assert "1 too few LEDs: frame 4" in text
    assert "1 tip slipped: frame 6" in text
    assert "px rms" in rows["Residuals"]
    assert "mm rms" in rows["Residuals"]
    assert "U =" in rows["Weakest"]


@pytest.mark.parametrize("method", ["joint", "two-stage"])
def test_the_text_shows_the_uncertainty_of_the_cone_under_it(method: Method) -> None:
    found = record(method)
    text = calibration_text(replace(calibration(), method=method), None, verdict())
    lines = iter(text.splitlines())

    assert any(line.startswith("Cone") for line in lines)
    shown = [next(lines).split()[-3:], next(lines).split()[-3:]]
    np.testing.assert_allclose(
        np.array(shown, dtype=np.float64),
        [found["cone_cam_mm"], found["cone_expanded_uncertainty_mm"]],
        atol=5.1e-5,
    )


def test_an_led_that_was_never_found_is_warned_of() -> None:
    (warning,) = record()["warnings"]

    assert warning["code"] == "warning.led-unseen"
    assert warning["values"] == {"led": 10}
    assert warning["text"].startswith("LED 10 was not detected in any image.")
    assert warning["text"] in calibration_text(calibration(), None, verdict())


def test_large_residuals_are_warned_of() -> None:
    rng = np.random.default_rng(2)
    swing = swing_poses(20, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.3, rng
    )
    noisy = calibrate_pixels(pixels, CAMERA, PEN)

    (warning,) = warnings_of(noisy)

    assert "Residuals are large" in str(warning)
    assert "intrinsics file" in str(warning)


def test_a_pivot_calibration_is_recorded_and_shown() -> None:
    swing = swing_poses(30, np.random.default_rng(1))
    noise = 0.1 * np.random.default_rng(2).standard_normal((30, 3))
    calibration = calibrate_pivot(swing.rotations, swing.translations + noise)

    places = np.arange(30)
    record = pivot_record(calibration, FILE, False, places, n_lost=0)
    found = json.loads(json_bytes(record))

    np.testing.assert_allclose(found["tip_pen_mm"], swing.tip_pen, atol=0.5)
    uncertainty = 2 * np.sqrt(np.diag(found["covariance"]))
    np.testing.assert_allclose(found["expanded_uncertainty_mm"], uncertainty[:3])
    np.testing.assert_allclose(found["pivot_expanded_uncertainty_mm"], uncertainty[3:])
    assert found["poses"] == {"total": 30, "used": 30, "lost": 0}
    assert len(found["frames"]) == 30
    assert found["warnings"] == []
    text = pivot_text(calibration)
    assert "Poses        30 of 30 used" in text
    assert found["uncertainty"]["covers"] in text
    assert found["uncertainty"]["leaves_out"] in text


@pytest.mark.parametrize(("jitter", "is_reported"), [(0.01, True), (0.0003, False)])
def test_a_jitter_is_reported_where_it_is_more_than_round_parts_make(
    jitter: float, is_reported: bool
) -> None:
    rng = np.random.default_rng(7)
    swing = swing_poses(40, rng)
    seat = jitter * rng.standard_normal(swing.translations.shape)
    translations = swing.translations + seat
    pixels = simulate_centers(CAMERA, PEN, swing.rotations, translations, 0.001, rng)
    found = calibrate_pixels(pixels, CAMERA, PEN)

    assert found.bundle.components.jitter.covariance is not None
    reported = {warning.code for warning in warnings_of(found)}
    assert ("warning.seat-jitter" in reported) == is_reported


def shown(found: Calibration, start: str) -> list[str]:
    """Return the lines of the text that start so."""
    text = calibration_text(found, None, verdict())
    return [line for line in text.splitlines() if line.startswith(start)]


def test_the_first_five_images_left_out_are_named() -> None:
    names = [f"frame {i}" for i in (2, 4, 6, 8, 10, 12)]
    for n, named in ((5, ", ".join(names[:5])), (6, ", ".join(names[:5]) + ", ...")):
        reasons = [Reason.NONE] * 40
        for i in range(n):
            reasons[2 * i + 1] = Reason.SLIPPED
        (camera,) = calibration().cameras
        images = replace(camera, reasons=tuple(reasons))
        found = replace(calibration(), cameras=(images,), reasons=tuple(reasons))

        assert shown(found, "  dropped") == [f"  dropped    {n} tip slipped: {named}"]


@pytest.mark.parametrize(
    ("angle", "said"),
    [
        (0.3, "along the pen's y axis, U ="),  # whose cosine is 0.955
        (0.33, "along (0.00, 0.95, 0.32) of the pen, U ="),
    ],
)
def test_a_weakest_direction_near_an_axis_is_named_by_it(
    angle: float, said: str
) -> None:
    along = np.array([0.0, np.cos(angle), np.sin(angle)])
    covariance = 1e-8 * np.eye(6)
    covariance[:3, :3] += 1e-4 * np.outer(along, along)
    share = UncertaintyContribution(ContributionName.NOISE, covariance)
    budget = replace(calibration().budget, shares=(share,))

    (line,) = shown(replace(calibration(), budget=budget), "Weakest")
    assert said in line
