"""Tests of `lightpen_extensions.comparisons.pen_health`."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from tests.simulated_centers import simulate_centers
from tests.simulated_sessions import recorded

from lightpen.detection.observations import observe_centers
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.observation_files import Centers
from lightpen.formats.own_json import FileRecord
from lightpen.model.pen import Pen
from lightpen.record.calibrations import CalibrationFile
from lightpen_extensions.comparisons.pen_health import examine_pen
from lightpen_extensions.simulator.swings import (
    paper_camera,
    paper_pen,
    perturbed_pen,
    swing_poses,
)

N_IMAGES, SIGMA = 40, 0.02
PEN_FILE = replace(paper_pen(), led_sigma=0.01)
Swing = Callable[..., CalibrationFile]


@pytest.fixture
def swing(tmp_path: Path) -> Swing:
    """Return a function that swings a pen and calibrates it with the same files."""
    when = datetime(2026, 1, 1, tzinfo=UTC)

    def swung(pen: Pen, number: int) -> CalibrationFile:
        rng, camera = np.random.default_rng(number), paper_camera()
        swing = swing_poses(N_IMAGES, rng, pen=pen, camera=camera)
        poses = swing.rotations, swing.translations
        pixels = simulate_centers(camera, pen, *poses, SIGMA, rng)
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

    found = examine_pen(swings, PEN_FILE.leds)

    assert found.moved == (7,)
    assert found.assessment.grade is Grade.REPEAT
    assert found.assessment.reason.values["led"] == 7
    # Of 0.05 mm; the best move of all LEDs takes some of it up.
    assert found.assessment.reason.values["distance"] == pytest.approx(0.05, abs=0.01)


def test_a_sound_pen_is_left_alone(swing: Swing) -> None:
    swings = [swing(true_pen(), number) for number in (1, 2, 3)]

    found = examine_pen(swings, PEN_FILE.leds)

    assert found.assessment.grade is Grade.STEADY


def test_one_swing_and_swings_of_two_pens_are_refused(swing: Swing) -> None:
    one, other = swing(true_pen(), 1), swing(true_pen(), 2)
    with pytest.raises(CalibrationError, match="One swing does not show"):
        examine_pen([one], PEN_FILE.leds)
    pen = FileRecord("other.csv", "1" * 64)
    inputs = structs.replace(other.calibration.inputs, pen=pen)
    record = structs.replace(other.calibration, inputs=inputs)
    of_other_pen = replace(other, calibration=record)
    with pytest.raises(UsageError, match=r"swing 2\.json was calibrated with another"):
        examine_pen([one, of_other_pen], PEN_FILE.leds)
