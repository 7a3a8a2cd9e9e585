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
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

CAMERA, PEN = paper_camera(), paper_pen()
LEDS = PEN.leds
STILL: FloatArray = np.zeros_like(LEDS)
CONE = np.array([10.0, 20.0, 1000.0])


def swing(
    number: int,
    displacements: FloatArray = STILL,
    *,
    growth: float = 0.0,
    cone: FloatArray = CONE,
    repeatability: float = 1e-9,
    camera: str = "camera",
    pen: str = "pen",
    is_of_rig: bool = False,
    is_contradicted: bool = False,
    n_intrinsics: int = len(CAMERA.intrinsics),
) -> Any:
    """The figures of a calibration with a pen that grew."""
    record = SimpleNamespace(
        adjusted=SimpleNamespace(contradictions=(1,) if is_contradicted else ()),
        uncertainty=SimpleNamespace(distance_repeatability=repeatability),
        instrument=SimpleNamespace(intrinsics=CAMERA.intrinsics[:n_intrinsics]),
    )
    return SimpleNamespace(
        path=Path(f"swing {number}.json"),
        pen_sha256=pen,
        camera_sha256=camera,
        displacements=displacements,
        cone_cam=cone * np.exp(-growth),
        is_of_rig=is_of_rig,
        calibration=record,
    )


def examined(*swings: Any) -> PenHealth:
    return examine_pen(swings, CAMERA, LEDS)


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


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("growths", "repeatability", "least"),
    [
        ([1.0], 1e-9, 6e-5),  # it matters
        # More than chance: of one change, and of the larger one of two.
        ([1.0], 1e-4, 2.575829 * np.sqrt(2) * 1e-4),
        ([0.5, 1.0], 1e-4, 2.807034 * np.sqrt(2) * 1e-4),
        ([1.0, 0.5], 1e-4, 2.807034 * np.sqrt(2) * 1e-4),
    ],
)
@pytest.mark.parametrize("by", [0.999, 1.001])
def test_a_pen_has_grown_by_more_than_chance_and_more_than_matters(
    sign: int, growths: list[float], repeatability: float, least: float, by: float
) -> None:
    largest = sign * by * least
    found = examined(
        swing(0, repeatability=repeatability),
        *(
            swing(i, growth=largest * each, repeatability=repeatability)
            for i, each in enumerate(growths, 1)
        ),
    )

    assert found.growth is not None
    assert found.growth.relative == pytest.approx(largest)
    assert found.growth.uncertainty == pytest.approx(2 * np.sqrt(2) * repeatability)
    assert found.assessment.grade is (Grade.CHECK if by > 1 else Grade.STEADY)
    said = found.assessment.reason.values
    if by > 1:
        assert said["growth"] == pytest.approx(1e6 * largest)
        assert said["uncertainty"] == pytest.approx(1e6 * found.growth.uncertainty)
        assert said["kelvin"] == pytest.approx(largest / 23e-6)
    else:
        assert said["n_swings"] == 1 + len(growths)


def test_the_most_significant_growth_counts_not_the_largest() -> None:
    found = examined(
        swing(0), swing(1, growth=2e-4, repeatability=1e-4), swing(2, growth=1e-4)
    )

    assert found.growth is not None
    assert found.growth.relative == pytest.approx(1e-4)


@pytest.mark.parametrize(("pixels", "is_known"), [(0.49, True), (0.51, False)])
def test_a_growth_is_known_while_the_cone_stays_within_half_a_pixel(
    pixels: float, is_known: bool
) -> None:
    moved = CONE + np.array([pixels * CONE[2] / CAMERA.fx, 0.0, 0.0])
    found = examined(swing(0), swing(1, cone=moved, growth=1e-3))

    assert (found.growth is not None) == is_known


@pytest.mark.parametrize(
    "other",
    [
        {"camera": "another"},
        {"is_of_rig": True},
        {"is_contradicted": True},
        {"n_intrinsics": 4},
    ],
)
def test_a_growth_is_known_from_swings_of_one_camera_that_agree_with_their_files(
    other: dict[str, Any],
) -> None:
    usual = swing(1, growth=1e-3)
    unlike, later = swing(0, **other), swing(2, growth=3e-3)

    def growths(*swings: Any) -> list[bool]:
        return [each.growth is not None for each in examined(*swings).swings]

    assert growths(usual, unlike) == [False, False]
    assert growths(usual, unlike, later) == [False, False, True]
    # One that tells nothing of the size cannot be the first; one of others is.
    has_size = "camera" in other or "n_intrinsics" in other
    assert growths(unlike, usual, later) == [False, False, not has_size]
    assert examine_pen([usual, later], None, LEDS).growth is None


def test_one_swing_or_two_pens_are_refused() -> None:
    with pytest.raises(CalibrationError):
        examined(swing(1))
    with pytest.raises(UsageError) as refused:
        examined(swing(1), swing(2), swing(3, pen="other"))
    said = refused.value.message.values
    assert (said["first"], said["other"]) == ("swing 1.json", "swing 3.json")
    with pytest.raises(UsageError):
        examined(swing(1, pen="other"), swing(2), swing(3, pen="other"))
