"""The verdict: good, to be looked at, or to be repeated, with the reason."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, observe_pixels, simulate_centers

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report_warnings import rejected_centres, warnings_of
from lightpen.estimation.reports.verdict import (
    Change,
    Grade,
    NextStep,
    Verdict,
    change_doubt,
    change_since,
    distance_from_nominal,
    halves_agree,
    judge,
    judge_change,
    judge_unknown,
    repeats,
)
from lightpen.estimation.uncertainty.budget import (
    ContributionName,
    SplitHalfCheck,
    UncertaintyContribution,
)
from lightpen.estimation.variance_components import Component
from lightpen.messages import NO_TEMPERATURE, Code, Message, message, too_little_tilt
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.swings import (
    Postures,
    Swing,
    paper_camera,
    paper_pen,
    swing_from_postures,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()


def calibrated(
    swing: Swing, sigma: float = 0.05, camera: Camera = CAMERA, pen: Pen = PEN
) -> Calibration:
    rng = np.random.default_rng(1)
    pixels: FloatArray = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, sigma, rng
    )
    return calibrate_pixels(pixels, camera, pen)


@pytest.fixture(scope="module")
def good() -> Calibration:
    return calibrated(swing_poses(150, np.random.default_rng(0)))


def test_the_verdict_judges_the_reported_method(good: Calibration) -> None:
    limits = SwingLimits(max_uncertainty=0.02)
    verdict = judge(replace(good, method="two-stage"), limits)

    assert judge(good, limits).grade is Grade.PASS
    assert verdict.grade is not Grade.PASS
    assert verdict.reason.code == Code.TWO_STAGE_OFF
    assert verdict.next_step is NextStep.REPORT_JOINT


def test_a_two_stage_tip_of_small_discs_passes() -> None:
    small = replace(PEN, diameter=2.0, diameter_sigma=0.02)
    swing = swing_poses(150, np.random.default_rng(0))
    pixels = simulate_centers(
        CAMERA,
        small,
        swing.rotations,
        swing.translations,
        0.02,
        np.random.default_rng(1),
    )
    seen = observe_pixels(pixels, CAMERA, small)
    found = replace(calibrate(CAMERA, small, seen), method="two-stage")

    verdict = judge(found, SwingLimits(max_uncertainty=0.03))
    assert verdict.grade is Grade.PASS
    uncertainty = float(str(verdict.reason.values["uncertainty"]))
    assert np.abs(found.two_stage.tip_pen - swing.tip_pen).max() < uncertainty


def test_a_good_calibration_passes_with_its_uncertainty(good: Calibration) -> None:
    verdict = judge(good, SwingLimits(max_uncertainty=0.02))
    assert verdict.grade is Grade.PASS
    assert verdict.reason == message(
        Code.GOOD_UNCHECKED,
        uncertainty=good.budget.weakest_uncertainty,
        what=message("unchecked.diameter"),
    )
    unchecked = "The scale of the LED file is not checked by this calibration"
    assert unchecked in str(verdict.reason)


def test_many_rejected_centres_are_checked_with_their_led(good: Calibration) -> None:
    limits = SwingLimits(max_uncertainty=0.02)
    images = good.cameras[0]
    assert rejected_centres(good).share < 0.001

    def without(mask: BoolArray) -> Calibration:
        fewer = replace(images, leds_used=images.leds_used & ~mask)
        return replace(good, cameras=(fewer,))

    led_4 = np.zeros_like(images.leds_used)
    led_4[:, 3] = True
    verdict = judge(without(led_4), limits)  # a tenth of all
    assert verdict.grade is Grade.CHECK
    assert verdict.reason == message(Code.LED_REJECTED, led=4, percent=100.0)
    assert verdict.next_step is NextStep.SEE_TO_CAUSE
    led_4[1::2, 3] = False
    assert judge(without(led_4), limits).grade is Grade.PASS  # half of its own
    led_4[:, 3] = True
    led_4[::5, 6] = True
    verdict = judge(without(led_4), limits)
    assert (verdict.grade, verdict.reason.code) == (Grade.CHECK, Code.CENTRES_REJECTED)
    assert verdict.reason.values["percent"] == pytest.approx(12.0, abs=0.1)
    assert verdict.reason.values["where"] == message("rejected.led", led=4)

    few = np.zeros_like(images.leds_used)
    few[:, [0, 6]] = True
    few[::10, 2] = True
    assert rejected_centres(without(few)).where == message("rejected.leds", leds="1, 7")
    few[::2] = True
    few[1::2] = False
    everywhere = message("rejected.everywhere")
    assert rejected_centres(without(few)).where == everywhere

    pixels = images.observations.pixels
    middle = (np.nanmin(pixels, axis=(0, 1)) + np.nanmax(pixels, axis=(0, 1))) / 2
    upper_left = (pixels < middle).all(axis=2)
    found = rejected_centres(without(upper_left))
    assert found.where == message("rejected.upper-left")


@pytest.mark.parametrize(("share", "grade"), [(0.9, Grade.CHECK), (0.3, Grade.REPEAT)])
def test_a_larger_uncertainty_is_checked_and_a_far_larger_one_repeated(
    good: Calibration, share: float, grade: Grade
) -> None:
    limit = share * good.budget.weakest_uncertainty
    verdict = judge(good, SwingLimits(max_uncertainty=limit))
    assert verdict.grade is grade
    assert good.budget.largest_share.name is ContributionName.NOISE
    assert verdict.reason.code == Code.UNCERTAIN


def test_halves_that_differ_along_any_axis_by_more_than_is_allowed_are_checked(
    good: Calibration,
) -> None:
    """The axis that differs most certainly is not the one that differs most."""
    uncertainty = np.array([0.0005, 0.005, 0.005])
    halves = SplitHalfCheck(np.array([0.004, 0.025, 0.0]), uncertainty)
    limits = SwingLimits(max_uncertainty=0.02)
    verdict = judge(replace(good, halves=halves), limits)
    assert verdict.reason == message(Code.HALVES_DIFFER, difference=0.025, usual=0.005)

    small = SplitHalfCheck(np.array([0.004, 0.006, 0.0]), uncertainty)
    assert judge(replace(good, halves=small), limits).grade is Grade.PASS


def test_leds_that_do_not_fit_are_checked() -> None:
    noisy = calibrated(swing_poses(300, np.random.default_rng(0)), sigma=0.15)
    verdict = judge(noisy, SwingLimits(max_uncertainty=0.05))
    assert verdict.reason.code == Code.LEDS_MISFIT
    assert verdict.reason.values["sigma"] == noisy.bundle.sigma


def test_a_seat_that_moves_is_not_taken_for_leds_that_do_not_fit() -> None:
    swing = swing_poses(150, np.random.default_rng(0))
    moves = np.random.default_rng(2).normal(0, 0.05, swing.translations.shape)
    moved = calibrated(replace(swing, translations=swing.translations + moves), 0.03)
    assert moved.joint.sigma > 0.15
    assert judge(moved, SwingLimits(max_uncertainty=0.05)).grade is Grade.PASS
    codes = {each.code for each in warnings_of(moved)}
    assert "warning.seat-jitter" in codes
    assert "warning.large-residuals" not in codes


def with_share(
    calibration: Calibration, name: ContributionName, u: float, *, assumed: bool = False
) -> Calibration:
    """Return a calibration with one more share, of so large a U (k = 2) along y."""
    along_y = np.diag([0.0, (u / 2) ** 2, 0.0, 0.0, 0.0, 0.0])
    kept = tuple(each for each in calibration.budget.shares if each.name is not name)
    shares = (*kept, UncertaintyContribution(name, along_y, assumed))
    return replace(calibration, budget=replace(calibration.budget, shares=shares))


def with_led_sigma(calibration: Calibration, sigma: float) -> Calibration:
    bundle = calibration.bundle
    counted = bundle.budget_components._replace(leds=Component(sigma, 100.0))
    return replace(calibration, bundle=replace(bundle, budget_components=counted))


def test_an_uncertainty_by_leds_that_are_off_is_reported_as_such(
    good: Calibration,
) -> None:
    off = with_led_sigma(with_share(good, ContributionName.LEDS, 0.02), 0.1)
    by_leds = off.budget.weakest_share(off.budget.largest_share)
    assert by_leds == pytest.approx(0.02, rel=1e-2)

    verdict = judge(off, SwingLimits(max_uncertainty=0.015))
    assert verdict.grade is Grade.CHECK
    assert verdict.reason == message(Code.LEDS_OFF, sigma=0.1, uncertainty=by_leds)
    assert judge(off, SwingLimits(max_uncertainty=0.005)).grade is Grade.REPEAT
    assert (
        judge(off, SwingLimits(max_uncertainty=0.03)).reason.code == Code.GOOD_UNCHECKED
    )

    small = with_led_sigma(off, 0.01)
    verdict = judge(small, SwingLimits(max_uncertainty=0.015))
    assert verdict.reason.code == Code.FILE_UNCERTAIN


@pytest.mark.parametrize(
    ("name", "words", "step"),
    [
        (
            ContributionName.CAMERA,
            "the intrinsics file. Calibrate the camera",
            "intrinsics file",
        ),
        (ContributionName.LEDS, "the LED file. Measure the LEDs more", "LED file"),
        (
            ContributionName.DIAMETER,
            "the diameter of the LED discs. State it",
            "LED file",
        ),
        (ContributionName.LENS, "the lens, beyond its distortion", "intrinsics file"),
        (ContributionName.FORM, "the form error of ball and cone", "cause"),
        (
            ContributionName.EXTRINSICS,
            "the extrinsics of the cameras. Calibrate the rig",
            "rig file",
        ),
    ],
)
@pytest.mark.parametrize(
    ("assumed", "how"), [(True, "is assumed for"), (False, "due to")]
)
def test_the_reason_names_the_largest_share_and_what_would_shrink_it(
    good: Calibration,
    name: ContributionName,
    words: str,
    step: str,
    assumed: bool,
    how: str,
) -> None:
    large = with_share(good, name, 0.02, assumed=assumed)
    verdict = judge(large, SwingLimits(max_uncertainty=0.015))

    assert verdict.grade is Grade.CHECK
    reported = str(verdict.next_step.message)
    named = ("intrinsics file", "LED file", "rig file", "cause")
    assert [each for each in named if each in reported] == [step]
    assert f"{how} {words}" in str(verdict.reason)
    assert "More images hardly help." in str(verdict.reason)


def test_a_camera_that_may_turn_is_not_blamed_on_the_intrinsics_file() -> None:
    camera = replace(CAMERA, covariance=1e-10 * np.eye(9))
    pen = replace(PEN, led_sigma=1e-6, scale_sigma=1e-9, diameter_sigma=1e-5)
    found = calibrated(swing_poses(100, np.random.default_rng(0)), 0.05, camera, pen)
    limits = SwingLimits(max_uncertainty=0.9 * found.budget.weakest_uncertainty)
    assert found.budget.largest_share.name is ContributionName.CAMERA

    verdict = judge(found, limits)
    assert (verdict.grade, verdict.reason.code) == (Grade.CHECK, Code.CAMERA_TILTS)
    assert verdict.next_step is NextStep.CAPTURE_MORE
    assert "a camera that may turn as the operator moves" in str(verdict.reason)
    assert "intrinsics" not in f"{verdict.reason}{verdict.next_step.message}"

    by_file = with_share(found, ContributionName.CAMERA, 0.05)
    assert judge(by_file, limits).reason.code == Code.FILE_UNCERTAIN


@pytest.mark.parametrize(
    "name", [ContributionName.NOISE, ContributionName.SEAT, ContributionName.DRIFT]
)
def test_what_more_images_shrink_asks_for_more_of_them(
    good: Calibration, name: ContributionName
) -> None:
    large = with_share(good, name, 0.02)
    verdict = judge(large, SwingLimits(max_uncertainty=0.015))

    assert verdict.reason.code == Code.UNCERTAIN
    assert verdict.next_step is NextStep.CAPTURE_MORE


@pytest.mark.slow
def test_a_tip_by_assumptions_alone_passes_only_within_the_limit_with_them() -> None:
    unknown = replace(CAMERA, covariance=None)
    bare = replace(PEN, scale_sigma=None, diameter_sigma=None)
    swing = swing_poses(150, np.random.default_rng(0))
    result = calibrated(swing, camera=unknown, pen=bare)
    uncertainty = result.budget.weakest_uncertainty
    (discs,) = [each for each in result.budget.shares if each.name == "disc diameter"]

    assert discs.assumed
    assert discs.standard_uncertainty[2] > 0.001
    below = SwingLimits(max_uncertainty=0.99 * uncertainty)
    assert judge(result, below).grade is not Grade.PASS
    within = SwingLimits(max_uncertainty=1.01 * uncertainty)
    assert judge(result, within).grade is Grade.PASS


def led_misplaced_too(warning: Message) -> Message:
    return replace(warning, values={**warning.values, "led": 2})


def test_an_led_off_its_place_is_checked_though_the_tip_is_certain() -> None:
    leds = PEN.leds.copy()
    leds[8, 1] += 3.0
    wrong = replace(PEN, leds=leds)
    swing = swing_poses(150, np.random.default_rng(0))
    pixels: FloatArray = simulate_centers(
        *(CAMERA, PEN, swing.rotations, swing.translations, 0.05),
        np.random.default_rng(1),
    )
    calibration = calibrate_pixels(pixels, CAMERA, wrong)

    verdict = judge(calibration, SwingLimits(max_uncertainty=0.05))
    assert verdict.grade is Grade.CHECK
    assert verdict.reason.code == Code.LED_DISPLACED
    assert verdict.reason.values["led"] == 9
    assert verdict.reason.values["distance"] == pytest.approx(3.0, abs=0.05)
    with_another = replace(calibration.leds, displaced=(2, 9))
    other = judge(replace(calibration, leds=with_another), SwingLimits())
    assert other.reason.values["led"] == 9  # the one that is farther off
    doubts = [each for each in warnings_of(calibration) if "LED 9 is " in each.text()]
    assert len(doubts) == 1
    assert repeats(doubts[0], verdict.reason)  # it is not reported twice
    assert not repeats(led_misplaced_too(doubts[0]), verdict.reason)


def test_a_tip_far_from_its_nominal_place_is_noticed() -> None:
    tip = np.array([0.0, 140.0, 2.0])
    assert distance_from_nominal(tip, None) is None
    assert distance_from_nominal(tip + np.array([0.0, 2.9, 0.0]), tip) is None
    assert distance_from_nominal(tip, tip - [3.0, 4.0, 0.0]) == pytest.approx(5.0)


def test_images_without_the_pen_do_not_count_however_many(good: Calibration) -> None:
    """A camera that runs before and after the swing says nothing about the tip."""
    no_pen = (Reason.EMPTY, Reason.TOO_FEW_LEDS, Reason.BLURRED, Reason.UNREADABLE)
    used = np.arange(len(good.used)) % 3 == 0
    reasons = tuple(
        Reason.NONE if is_used else no_pen[i % len(no_pen)]
        for i, is_used in enumerate(used)
    )
    few = replace(good, used=used, reasons=reasons)
    limits = SwingLimits(max_uncertainty=0.02, min_images=50)
    assert judge(few, limits).grade is Grade.PASS
    verdict = judge(few, replace(limits, min_images=51))
    assert verdict.reason == message(Code.TOO_FEW_IMAGES, n_kept=50, needed=51)


@pytest.mark.parametrize("reason", [Reason.SLIPPED, Reason.MISFIT, Reason.TAKEN_OUT])
def test_images_of_the_pen_that_are_left_out_count(
    good: Calibration, reason: Reason
) -> None:
    used = good.used.copy()
    used[:31] = False
    reasons = (reason,) * 31 + good.reasons[31:]
    limits = SwingLimits(max_uncertainty=0.02, min_images=150)
    verdict = judge(replace(good, used=used, reasons=reasons), limits)
    is_by_user = reason is Reason.TAKEN_OUT
    reported = (
        message(Code.MANY_EXCLUDED, n_excluded=31)
        if is_by_user
        else message(Code.MANY_DROPPED, n_dropped=31, n_images=150)
    )
    assert verdict.reason == reported


def test_sides_that_the_pen_never_leant_to_are_named() -> None:
    rng = np.random.default_rng(0)
    postures = Postures(
        np.radians(rng.uniform(10, 30, 150)),
        np.radians(rng.uniform(-20, 155, 150)),
        np.radians(rng.uniform(-30, 30, 150)),
    )
    calibration = calibrated(swing_from_postures(postures))
    limits = SwingLimits(max_uncertainty=0.05)
    verdict = judge(calibration, limits)
    assert verdict.grade is Grade.CHECK
    assert verdict.reason == too_little_tilt(8, (4, 5, 6, 7))
    assert str(verdict.reason) == (
        "Not enough tilt to the left, towards the camera to the left, towards the "
        "camera, towards the camera to the right. Tilt the pen further. "
        "Images needed: about 8."
    )
    unasked = judge(calibration, replace(limits, min_per_field=0))
    assert unasked.grade is Grade.PASS


@pytest.mark.parametrize(
    ("code", "step"),
    [
        (Code.GOOD, NextStep.ACCEPT),
        (Code.UNCERTAIN, NextStep.CAPTURE_MORE),
        (Code.TOO_LITTLE_TILT, NextStep.CAPTURE_MORE),
        (Code.TOO_FEW_IMAGES, NextStep.CAPTURE_MORE),
        (Code.HALVES_DIFFER, NextStep.REPEAT),
        (Code.MANY_DROPPED, NextStep.REPEAT),
        (Code.MANY_EXCLUDED, NextStep.REPEAT),
        (Code.LEDS_MISFIT, NextStep.CHECK_FILES),
        (Code.LEDS_OFF, NextStep.CHECK_LEDS),
        (Code.LED_DISPLACED, NextStep.CHECK_LEDS),
        (Code.NOT_SIMULTANEOUS, NextStep.REPEAT),
        (Code.CAMERA_MOVED, NextStep.CLAMP),
    ],
)
def test_every_reason_has_one_next_step(code: Code, step: NextStep) -> None:
    assert Verdict(Grade.CHECK, Message(code)).next_step is step


def test_halves_may_differ_by_what_chance_leaves() -> None:
    uncertainty = np.array([0.001, 0.002, 0.001])
    assert halves_agree(
        SplitHalfCheck(np.array([1.4, -1.4, 0.0]) * uncertainty, uncertainty)
    )
    assert not halves_agree(
        SplitHalfCheck(np.array([0.0, 0.0, -1.6]) * uncertainty, uncertainty)
    )


U_NOW, U_THEN = np.array([0.003, 0.003, 0.003]), np.array([0.004, 0.004, 0.004])


def change(difference: list[float]) -> Change:
    tip_then = np.array([1.0, -90.0, -24.0])
    return change_since(tip_then + difference, U_NOW, tip_then, U_THEN)


def test_a_change_is_uncertain_by_both_calibrations() -> None:
    found = change([0.03, 0.0, 0.04])

    np.testing.assert_allclose(found.expanded_uncertainty, 0.005)
    assert found.distance == pytest.approx(0.05)


PASSED = Verdict(Grade.PASS, message(Code.GOOD, uncertainty=0.004))


@pytest.mark.parametrize(
    ("difference", "grade"),
    [
        ([0.0, 0.0, 0.0], Grade.PASS),
        ([0.0059, 0.0, -0.0059], Grade.PASS),
        ([0.0, -0.0061, 0.0], Grade.CHECK),
        ([0.3, 0.2, 0.1], Grade.CHECK),
    ],
)
def test_a_change_that_uncertainty_does_not_explain_is_to_be_checked(
    difference: list[float], grade: Grade
) -> None:
    assert judge_change(PASSED, change(difference), "2026-01-02").grade is grade


def test_a_change_of_3_8_um_at_a_u_of_0_5_um_is_reported() -> None:
    u = np.full(3, 0.0005)
    found = change_since(np.array([0.0, 0.0038, 0.0005]), u, np.zeros(3), u)
    verdict = judge_change(PASSED, found, "2026-01-02")

    assert verdict.grade is Grade.CHECK
    assert str(verdict.reason) == (
        "The tip changed by 0.0038 mm since 2026-01-02: along y 0.0038 mm, more "
        "than the combined U (0.0007 mm). Was the tip replaced, bent or "
        "refitted?"
    )
    assert verdict.next_step is NextStep.CHECK_TIP


def test_a_large_change_that_uncertainty_explains_passes() -> None:
    tip, wide = np.zeros(3), np.full(3, 0.5)
    found = change_since(tip + 0.3, wide, tip, wide)
    assert judge_change(PASSED, found, "") is PASSED
    assert judge_change(PASSED, None, "") is PASSED


def test_what_is_wrong_with_a_tip_by_itself_counts_more_than_its_change() -> None:
    repeat = Verdict(Grade.REPEAT, message(Code.GOOD, uncertainty=0.4))
    assert judge_change(repeat, change([0.3, 0.2, 0.1]), "") is repeat
    assert judge_unknown(repeat, message(Code.GOOD, uncertainty=0.4)) is repeat


def test_a_fair_share_of_unchanged_tips_passes() -> None:
    """Of independent calibrations of one tip some 5 % are asked about."""
    rng = np.random.default_rng(3)
    u = np.array([0.002, 0.003, 0.004])
    tips = rng.normal(0.0, u / 2, (2, 2000, 3))
    found = [change_since(now, u, then, u) for now, then in zip(*tips, strict=True)]
    share = np.mean([each.is_unexplained for each in found])
    assert 0.035 < share < 0.065  # four standard deviations about 4.8 %


def test_a_fifth_of_all_images_may_be_dropped(good: Calibration) -> None:
    used = good.used.copy()
    used[:30] = False
    limits = SwingLimits(max_uncertainty=0.02)
    assert judge(replace(good, used=used), limits).grade is Grade.PASS

    used[30] = False
    assert judge(replace(good, used=used), limits).reason == message(
        Code.MANY_DROPPED, n_dropped=31, n_images=150
    )


def test_a_camera_that_moved_by_three_times_the_limit_is_checked(
    good: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = SwingLimits(max_uncertainty=0.02)
    monkeypatch.setattr(Calibration, "moved", 0.047)
    assert judge(good, limits).grade is Grade.PASS

    monkeypatch.setattr(Calibration, "moved", 0.061)
    assert judge(good, limits) == Verdict(
        Grade.CHECK, message(Code.CAMERA_MOVED, distance=0.061)
    )


def test_a_change_beyond_the_limit_of_the_tip_is_checked_though_it_is_explained() -> (
    None
):
    wide = np.full(3, 0.5)
    found = change_since(np.array([0.0, 0.06, 0.08]), wide, np.zeros(3), wide)

    assert change_doubt(found, "2026-01-02", 0.11) is None
    doubt = change_doubt(found, "2026-01-02", 0.09)
    assert doubt == message(
        Code.CHANGE_BEYOND_LIMIT, distance=0.1, date="2026-01-02", limit=0.09
    )
    assert judge_change(PASSED, found, "2026-01-02", 0.09).reason == doubt


def test_a_doubt_repeats_a_reason_of_the_same_code_and_led() -> None:
    displaced = message(Code.LED_DISPLACED, led=3, distance=0.05)
    warning = {
        led: message("warning.led-displaced", led=led, distance=0.05, u=0.01)
        for led in (3, 4)
    }

    assert repeats(
        message(Code.GOOD, uncertainty=0.1), message(Code.GOOD, uncertainty=0.2)
    )
    assert not repeats(message(Code.GOOD, uncertainty=0.1), displaced)
    assert repeats(warning[3], displaced)
    assert not repeats(warning[4], displaced)


def test_a_tip_without_a_temperature_passes_unless_the_station_requires_one(
    good: Calibration,
) -> None:
    limits = SwingLimits(max_uncertainty=0.02, requires_temperature=True)
    verdict = judge(good, limits)
    assert (verdict.grade, verdict.reason) == (Grade.CHECK, NO_TEMPERATURE)
    assert verdict.next_step is NextStep.SEE_TO_CAUSE

    assumptions = replace(good.assumptions, temperature_c=21.0)
    measured = replace(good, assumptions=assumptions)
    assert judge(measured, limits).grade is Grade.PASS


def test_copies_of_images_count_once(good: Calibration) -> None:
    """Given twice, they are neither as many as asked for nor lost."""
    doubled = replace(
        good,
        reasons=good.reasons + (Reason.COPY,) * 150,
        used=np.concatenate([good.used, np.zeros(150, dtype=bool)]),
        tips_cam=np.concatenate([good.tips_cam, np.full((150, 3), np.nan)]),
    )
    assert judge(doubled, SwingLimits(max_uncertainty=0.02)).grade is Grade.PASS
    limits = SwingLimits(max_uncertainty=0.02, min_images=200)
    assert judge(doubled, limits).reason == message(
        Code.TOO_FEW_IMAGES, n_kept=150, needed=200
    )


@pytest.mark.parametrize(
    ("diameter", "edge_width", "flaw"),
    [
        *((2.0, 2.5, "small-leds"), (10.0, 2.5, "clipped-leds")),
        *((2.0, np.nan, None), (10.0, np.nan, None)),
    ],
)
def test_faces_of_small_and_clipped_leds_in_images_are_said_to_be_unknown(
    diameter: float, edge_width: float, flaw: str | None
) -> None:
    swing = swing_poses(30, np.random.default_rng(0))
    pen = replace(PEN, diameter=diameter)
    pixels = simulate_centers(
        CAMERA, pen, swing.rotations, swing.translations, 0.05, np.random.default_rng(1)
    )
    seen = replace(
        observe_pixels(pixels, CAMERA, pen), edge_widths=np.full(30, edge_width)
    )
    warnings = warnings_of(calibrate(CAMERA, pen, seen))
    codes = ("warning.small-leds", "warning.clipped-leds")
    found = [each for each in warnings if each.code in codes]
    assert [each.code for each in found] == ([f"warning.{flaw}"] if flaw else [])
    if flaw == "small-leds":
        assert found[0].values["width"] == pytest.approx(8.4, abs=0.5)
        assert found[0].values["depth"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("n_out", "code"), [(20, Code.MANY_DROPPED), (21, Code.MANY_EXCLUDED)]
)
def test_images_are_said_to_be_taken_out_if_most_of_the_dropped_ones_are(
    good: Calibration, n_out: int, code: Code
) -> None:
    reasons = [Reason.TAKEN_OUT] * n_out + [Reason.SLIPPED] * (40 - n_out)
    reasons += [Reason.NONE] * 110
    used = np.array([reason is Reason.NONE for reason in reasons])
    found = replace(good, reasons=tuple(reasons), used=used)

    assert judge(found, SwingLimits(max_uncertainty=0.02)).reason.code == code
