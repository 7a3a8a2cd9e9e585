"""Tests of `lightpen.comparisons.pen_health` and `led_file`."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from msgspec import structs
from tests.simulated_sessions import recorded

from lightpen.comparisons.assessment import Scale
from lightpen.comparisons.led_file import _is_better, improve_pen
from lightpen.comparisons.pen_health import examine_pen
from lightpen.detection.observations import observe_centers
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.reports.calibration_record import ContradictionRecord
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.observation_files import Centers
from lightpen.formats.own_json import FileRecord
from lightpen.formats.pen_files import read_pen, write_pen
from lightpen.model.pen import Pen
from lightpen.model.self_calibration import EXACT_SCALE, FoundPen, marks_of
from lightpen.record.calibrations import CalibrationFile, shown_images
from lightpen_extensions.simulator.swings import (
    PAPER_TIP,
    paper_camera,
    paper_pen,
    perturbed_pen,
    simulate_centers,
    swing_poses,
)

N_IMAGES, SIGMA = 40, 0.02
PEN_FILE = replace(paper_pen(), led_sigma=0.01)
WARMTH = 5 * 23e-6  # 5 K of aluminium
Swing = Callable[..., CalibrationFile]


@pytest.fixture
def swing(tmp_path: Path) -> Swing:
    """Return a function that swings a pen and calibrates it with the same files."""
    when = datetime(2026, 1, 1, tzinfo=UTC)

    def swung(pen: Pen, number: int, growth: float = 0.0) -> CalibrationFile:
        rng = np.random.default_rng(number)
        grown = replace(pen, leds=pen.leds * (1 + growth))
        camera = paper_camera()
        poses = swing_poses(
            N_IMAGES, rng, pen=grown, camera=camera, tip_pen=PAPER_TIP * (1 + growth)
        )
        pixels = simulate_centers(
            camera, grown, poses.rotations, poses.translations, SIGMA, rng
        )
        centers = Centers(np.arange(1, N_IMAGES + 1), pixels, Path("centers.csv"))
        found = calibrate(camera, PEN_FILE, observe_centers(centers, camera, PEN_FILE))
        created = when + timedelta(days=number)
        return recorded(found, tmp_path / f"swing {number}.json", created)

    return swung


def true_pen() -> Pen:
    return perturbed_pen(paper_pen(), 0.01, np.random.default_rng(9))


def with_moved_led(pen: Pen) -> Pen:
    leds = pen.leds.copy()
    leds[6] += [0.03, 0.0, 0.04]
    return replace(pen, leds=leds)


def test_one_led_that_moved_is_named(swing: Swing) -> None:
    pen = true_pen()
    swings = [swing(pen, 1), swing(pen, 2), swing(with_moved_led(pen), 3)]

    found = examine_pen(swings, paper_camera(), PEN_FILE.leds)

    assert found.moved == (7,)
    assert found.assessment.grade is Grade.REPEAT
    assert found.assessment.reason.values["led"] == 7
    # Of 0.05 mm; the best move of all LEDs takes some of it up.
    assert found.assessment.reason.values["distance"] == pytest.approx(0.05, abs=0.01)


def test_a_warm_pen_is_distinguished_from_a_knocked_one(swing: Swing) -> None:
    pen = true_pen()
    swings = [swing(pen, 1), swing(pen, 2), swing(pen, 3, growth=WARMTH)]

    found = examine_pen(swings, paper_camera(), PEN_FILE.leds)

    assert found.moved == ()
    assert found.growth is not None
    assert found.growth.relative == pytest.approx(WARMTH, abs=found.growth.uncertainty)
    assert found.assessment.reason.code == "pen-health.grown"


@pytest.mark.parametrize("sigma", [1e-4, 5e-5])  # the growth is 0.6 or 1.2 times its U
def test_a_growth_within_its_uncertainty_is_not_called_one(
    swing: Swing, sigma: float
) -> None:
    pen = true_pen()
    warm = swing(pen, 3, growth=WARMTH)
    unsure = structs.replace(warm.calibration.uncertainty, distance_repeatability=sigma)
    record = structs.replace(warm.calibration, uncertainty=unsure)
    swings = [swing(pen, 1), replace(warm, calibration=record)]

    found = examine_pen(swings, paper_camera(), PEN_FILE.leds)

    assert found.growth is not None
    assert found.growth.uncertainty == pytest.approx(2 * sigma, rel=0.05)
    assert found.assessment.grade is Grade.STEADY


def test_a_swing_that_contradicts_its_files_tells_no_growth(swing: Swing) -> None:
    pen = true_pen()
    sound, warm = swing(pen, 1), swing(pen, 2, growth=WARMTH)
    contradiction = ContradictionRecord("focal length", "px", 1.0, 0.1, 2.0, 0.1, 9.0)
    adjusted = structs.replace(
        sound.calibration.adjusted, contradictions=(contradiction,)
    )
    record = structs.replace(sound.calibration, adjusted=adjusted)
    swings = [replace(sound, calibration=record), warm]

    found = examine_pen(swings, paper_camera(), PEN_FILE.leds)

    assert found.growth is None


def test_a_sound_pen_is_left_alone(swing: Swing) -> None:
    swings = [swing(true_pen(), number) for number in (1, 2, 3)]

    found = examine_pen(swings, paper_camera(), PEN_FILE.leds)

    assert found.assessment.grade is Grade.STEADY


def test_one_swing_and_swings_of_two_pens_are_refused(swing: Swing) -> None:
    one, other = swing(true_pen(), 1), swing(true_pen(), 2)
    with pytest.raises(CalibrationError, match="One swing does not show"):
        examine_pen([one], paper_camera(), PEN_FILE.leds)
    pen = FileRecord("other.csv", "1" * 64)
    inputs = structs.replace(other.calibration.inputs, pen=pen)
    record = structs.replace(other.calibration, inputs=inputs)
    of_other_pen = replace(other, calibration=record)
    with pytest.raises(UsageError, match=r"swing 2\.json was calibrated with another"):
        examine_pen([one, of_other_pen], paper_camera(), PEN_FILE.leds)


def test_pooled_swings_put_the_led_file_right(swing: Swing, tmp_path: Path) -> None:
    pen = true_pen()
    swings = [swing(pen, number) for number in (1, 2, 3, 4)]

    done = list[float]()

    found = improve_pen(swings, paper_camera(), PEN_FILE, report=done.append)

    assert done == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])

    def errors(leds: np.ndarray) -> np.ndarray:
        """Errors but for those of the frame, by the differences between LEDs."""
        found = np.linalg.norm(leds[:, None] - leds, axis=2)
        true = np.linalg.norm(pen.leds[:, None] - pen.leds, axis=2)
        return np.asarray(found - true)

    before, after = errors(PEN_FILE.leds), errors(found.pen.leds)
    assert np.sqrt(np.mean(after**2)) < 0.3 * np.sqrt(np.mean(before**2))
    assert found.sigma_after < found.sigma_before
    assert found.held_out == "swing 4.json"
    write_pen(found.pen, tmp_path / "new.json", "a" * 64)
    read = read_pen(tmp_path / "new.json")
    np.testing.assert_array_equal(read.leds, found.pen.leds)
    assert read.led_covariance is not None
    assert found.pen.led_covariance is not None
    np.testing.assert_array_equal(read.led_covariance, found.pen.led_covariance)
    assert '"parent_sha256": "aaaa' in (tmp_path / "new.json").read_text()


@pytest.mark.slow
def test_pooled_swings_put_the_camera_file_right(swing: Swing) -> None:
    true = paper_camera()
    swings = [swing(true_pen(), number) for number in (1, 2, 3, 4)]
    off = replace(true, fx=1.001 * true.fx, fy=1.001 * true.fy)

    found = improve_pen(swings, off, PEN_FILE).camera

    assert found.covariance is not None
    sigma = np.sqrt(np.diag(found.covariance))[:2]
    error = np.array([found.fx - true.fx, found.fy - true.fy])
    assert (np.abs(error) < 3 * sigma).all()
    assert np.abs(error).max() < 0.5 * (off.fx - true.fx)


def test_a_length_gives_the_new_file_its_scale(swing: Swing) -> None:
    swings = [swing(true_pen(), number) for number in (1, 2, 3, 4)]
    scale = Scale(1.0003, 1e-5, 1e-2)

    found = improve_pen(
        swings, paper_camera(), replace(PEN_FILE, scale_sigma=5e-3), scale
    )

    assert found.pen.scale_sigma == pytest.approx(5e-6, rel=0.1)
    extents = np.ptp(found.pen.leds[:4, 1]) / np.ptp(PEN_FILE.leds[:4, 1])
    # The LEDs at the ends of the pen are off by 0.01 mm in the file, of 180 mm.
    assert extents - 1 == pytest.approx(3e-4, abs=1e-4)


def test_what_no_swing_shows_stays_as_uncertain_as_the_file_states(
    swing: Swing,
) -> None:
    swings = [swing(true_pen(), number) for number in (1, 2, 3, 4)]
    scaling = (PEN_FILE.leds - PEN_FILE.leds.mean(axis=0)).ravel()
    known = 1e-4 * np.eye(len(scaling)) + 1e-6 * np.outer(scaling, scaling)
    stated = replace(
        PEN_FILE, led_sigma=None, scale_sigma=1e-6, expansion=0.0, led_covariance=known
    )

    found = improve_pen(swings, paper_camera(), stated)

    assert found.pen.led_covariance is not None
    unit = scaling / (scaling @ scaling)
    scale = np.sqrt(unit @ found.pen.led_covariance @ unit)
    assert scale == pytest.approx(1e-3, rel=0.1)
    of_shape = np.diag(found.pen.led_covariance) - (scale * scaling) ** 2
    assert of_shape.max() < 0.005**2


@pytest.mark.slow
def test_the_swing_that_the_file_was_found_from_counts_once(swing: Swing) -> None:
    swings = [swing(true_pen(), number) for number in (1, 2, 3)]
    marks = [marks_of(shown_images(each.calibration).pixels) for each in swings]
    before = FoundPen(marks[0], PEN_FILE.diameter, 0.05**2 * np.eye(PEN_FILE.leds.size))
    wide = replace(PEN_FILE, led_sigma=None, led_covariance=before.led_covariance)
    wide = replace(wide, scale_sigma=EXACT_SCALE, expansion=0.0)
    exact = replace(wide, led_covariance=1e-8 * before.led_covariance, found=before)

    by_exact, by_wide = (
        improve_pen(swings, paper_camera(), each, must_gain=False).pen
        for each in (exact, wide)
    )

    np.testing.assert_allclose(by_exact.leds, by_wide.leds, atol=1e-6)
    assert by_exact.led_covariance is not None
    assert by_wide.led_covariance is not None
    np.testing.assert_allclose(
        by_exact.led_covariance, by_wide.led_covariance, rtol=0.01, atol=1e-9
    )
    assert by_exact.found is not None
    np.testing.assert_array_equal(
        by_exact.found.marks, np.concatenate([marks[0], *marks[:2]])
    )


def test_a_swing_held_out_that_contradicts_the_others_is_named(swing: Swing) -> None:
    pen = true_pen()
    leds = pen.leds.copy()
    leds[6, 0] += 0.013  # less than what is called a move
    swings = [swing(pen, 1), swing(pen, 2), swing(replace(pen, leds=leds), 3)]

    with pytest.raises(CalibrationError, match=r"swing 3\.json contradicts the others"):
        improve_pen(swings, paper_camera(), PEN_FILE, must_gain=False)


@pytest.mark.slow
def test_a_swing_of_another_state_of_the_pen_does_not_confirm(swing: Swing) -> None:
    pen = true_pen()
    swings = [swing(with_moved_led(pen), number) for number in (1, 2, 3)]

    with pytest.raises(CalibrationError, match="does not confirm the new LED file"):
        improve_pen([*swings, swing(paper_pen(), 4)], paper_camera(), PEN_FILE)


def test_swings_of_before_and_after_a_knock_are_not_pooled(swing: Swing) -> None:
    pen = true_pen()
    swings = [
        swing(each, number)
        for number, each in enumerate([pen, *[with_moved_led(pen)] * 3], start=1)
    ]

    with pytest.raises(CalibrationError, match=r"swing 1\.json and swing 2\.json"):
        improve_pen(swings, paper_camera(), PEN_FILE)


def test_a_fit_is_better_by_the_size_of_its_residuals_whatever_their_sign() -> None:
    def fit(size: float, sign: int) -> Any:
        residuals = np.random.default_rng(3).uniform(0.5, 1.0, (N_IMAGES, 8, 2))
        used = np.ones(residuals.shape[:2], dtype=bool)
        return SimpleNamespace(used=used, residuals=sign * size * residuals)

    for sign in (1, -1):
        assert _is_better(fit(2.0, sign), fit(1.0, sign))
        assert not _is_better(fit(1.0, sign), fit(2.0, sign))


def test_too_few_swings_are_refused(swing: Swing) -> None:
    swings = [swing(true_pen(), number) for number in (1, 2, 3)]

    with pytest.raises(CalibrationError, match="Swings given: 3"):
        improve_pen(swings, paper_camera(), PEN_FILE)
