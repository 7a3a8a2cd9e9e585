"""Tests of whether intrinsics may still hold."""

from dataclasses import replace
from datetime import date

import pytest

from lightpen.model.camera import Camera, unmodelled_effects_of

CAMERA = Camera(640, 480, 900.0, 900.0, 320.0, 240.0)
TODAY = date(2026, 11, 22)


def test_a_file_that_says_nothing_of_itself_is_not_doubted() -> None:
    assert unmodelled_effects_of(CAMERA, TODAY, 35.0, "21704342") == ()


@pytest.mark.parametrize(
    ("day", "is_doubted"), [(date(2025, 11, 22), False), (date(2025, 11, 21), True)]
)
def test_a_file_of_more_than_a_year_is_doubted(day: date, is_doubted: bool) -> None:
    doubts = unmodelled_effects_of(replace(CAMERA, calibrated_on=day), TODAY)

    assert bool(doubts) == is_doubted


@pytest.mark.parametrize(
    ("celsius", "is_doubted"), [(24.9, False), (25.1, True), (14.9, True)]
)
def test_a_file_of_another_temperature_is_doubted(
    celsius: float, is_doubted: bool
) -> None:
    doubts = unmodelled_effects_of(replace(CAMERA, temperature_c=20.0), TODAY, celsius)

    assert bool(doubts) == is_doubted


def test_a_file_of_another_camera_is_doubted() -> None:
    camera = replace(CAMERA, serial="DEV-1")
    (doubt,) = unmodelled_effects_of(camera, TODAY, serial="DEV-2")

    assert "DEV-1" in str(doubt)
    assert unmodelled_effects_of(camera, TODAY, serial="dev-1") == ()
