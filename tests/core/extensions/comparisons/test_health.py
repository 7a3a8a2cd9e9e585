"""What is concluded from the figures of calibrations, whatever they came from."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.comparisons.pen_health import (
    PenHealth,
    _without_move,
    examine_pen,
)
from lightpen_extensions.simulator.swings import paper_pen

LEDS = paper_pen().leds
STILL: FloatArray = np.zeros_like(LEDS)


def swing(number: int, displacements: FloatArray = STILL, *, pen: str = "pen") -> Any:
    """The figures of a calibration."""
    return SimpleNamespace(
        path=Path(f"swing {number}.json"), pen_sha256=pen, displacements=displacements
    )


def examined(*swings: Any) -> PenHealth:
    return examine_pen(swings, LEDS)


def one_led(by: float, led: int = 4) -> FloatArray:
    moved = STILL.copy()
    moved[led - 1, 1] = by
    return moved


def test_motion_and_scale_of_all_leds_are_taken_off_but_not_a_knock_of_one() -> None:
    turn = rotation_from_vector(np.array([1e-6, -2e-6, 3e-6])) - np.eye(3)
    arms = LEDS - LEDS.mean(axis=0)
    whole = arms @ turn.T + 1e-4 * arms + np.array([0.3, -0.2, 0.1])
    knock = one_led(0.05)
    changes = whole + knock
    changes[0, 2] = np.nan

    found = _without_move(LEDS, changes)

    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1:], knock[1:], atol=1e-8)


@pytest.mark.parametrize(("by", "moved"), [(0.0199, ()), (0.0201, (4,))])
def test_an_led_has_moved_from_two_hundredths_on(
    by: float, moved: tuple[int, ...]
) -> None:
    elsewhere = one_led(0.04, 7)  # off its place in the file from the first swing on
    found = examined(swing(1, elsewhere), swing(2, elsewhere + one_led(by)))

    assert found.moved == moved
    assert found.assessment.grade is (Grade.REPEAT if moved else Grade.STEADY)


def test_an_led_that_moved_stands_out_five_times() -> None:
    noise = np.random.default_rng(1).normal(0, 0.01, LEDS.shape)
    ratios, verdicts = [], []
    for by in np.linspace(0.02, 0.14, 25):
        found = examined(swing(1), swing(2, noise + one_led(by)))
        lengths = np.linalg.norm(found.swings[1].shifts, axis=1)
        ratios.append(lengths[3] / np.median(lengths))
        verdicts.append(found.moved == (4,))

    assert [ratio > 5 for ratio in ratios] == verdicts
    assert {True, False} == {*verdicts}


def test_of_leds_that_moved_the_farthest_is_named_with_its_swing() -> None:
    far, near = one_led(0.08), one_led(0.05, 7)
    found = examined(swing(1), swing(2, near), swing(3, far + near), swing(4, near))

    assert found.moved == (4, 7)
    said = found.assessment.reason.values
    assert (said["led"], said["swing"]) == (4, "swing 3.json")
    assert said["distance"] == pytest.approx(0.08, abs=1e-4)


def test_one_swing_or_two_pens_are_refused() -> None:
    with pytest.raises(CalibrationError):
        examined(swing(1))
    with pytest.raises(UsageError) as refused:
        examined(swing(1), swing(2), swing(3, pen="other"))
    said = refused.value.message.values
    assert (said["first"], said["other"]) == ("swing 1.json", "swing 3.json")
    with pytest.raises(UsageError):
        examined(swing(1, pen="other"), swing(2), swing(3, pen="other"))
