"""`lightpen calibrate` names why LEDs are not where the files have them."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.formats.pen_files import write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA = paper_camera()
# In no known layout, so that its file is not refused at once.
LEDS = np.array(
    [
        *([-30.0, 10.0, -20.0], [25.0, 30.0, 0.0], [-10.0, 55.0, -35.0]),
        *([30.0, 85.0, -15.0], [-25.0, 110.0, 5.0], [5.0, 140.0, -30.0]),
        *([28.0, 165.0, 0.0], [-20.0, 180.0, -12.0]),
    ]
)
PEN = Pen(LEDS, np.tile([0.0, 0.0, 1.0], (8, 1)), 10.0, led_sigma=0.002)

Run = Callable[..., CompletedProcess[str]]
Calibrated = Callable[[Pen, FloatArray], tuple[str, dict[str, Any]]]


@pytest.fixture(scope="module")
def pixels() -> FloatArray:
    return seen_of(PEN)


@pytest.fixture
def calibrated(lightpen: Run, tmp_path: Path) -> Calibrated:
    """Return a function that calibrates from centres and gives output and record."""

    def run(pen: Pen, pixels: FloatArray) -> tuple[str, dict[str, Any]]:
        write_camera(CAMERA, tmp_path / "camera.yaml")
        write_pen(pen, tmp_path / "leds.json")
        rows = [
            f"{i + 1},{led + 1},{x!r},{y!r}"
            for (i, led), (x, y) in zip(
                np.ndindex(pixels.shape[:2]),
                pixels.reshape(-1, 2).tolist(),
                strict=True,
            )
            if np.isfinite(x)
        ]
        centers, record = tmp_path / "centers.csv", tmp_path / "record.json"
        centers.write_text("\n".join(["frame,led,x_px,y_px", *rows]), encoding="utf-8")
        outcome = lightpen(
            *("calibrate", "--centers", centers, "--camera", tmp_path / "camera.yaml"),
            *("--pen", tmp_path / "leds.json", "--json", record),
        )
        fields = json.loads(record.read_bytes()) if record.exists() else {}
        return outcome.stdout + outcome.stderr, fields

    return run


def seen_of(pen: Pen) -> FloatArray:
    rng = np.random.default_rng(4)
    swing = swing_poses(60, rng)
    return simulate_centers(CAMERA, pen, swing.rotations, swing.translations, 0.03, rng)


def with_leds(leds: FloatArray) -> Pen:
    return replace(PEN, leds=leds)


def exchanged(one: int, other: int) -> Pen:
    leds = PEN.leds.copy()
    leds[[one - 1, other - 1]] = leds[[other - 1, one - 1]]
    return with_leds(leds)


def moved(led: int, by: float) -> Pen:
    leds = PEN.leds.copy()
    leds[led - 1] += [0.0, by, by]
    return with_leds(leds)


@pytest.mark.parametrize(
    ("pen", "named"),
    [
        (exchanged(2, 3), "LEDs 2 and 3 are exchanged"),
        (with_leds(PEN.leds * [-1, 1, 1]), "or the images are mirrored"),
        (with_leds(PEN.leds * [1, -1, 1]), "mirror image of the pen (sign of x"),
        (with_leds(PEN.leds * [1, 1, -1]), "mirror image of the pen (sign of z)"),
        (with_leds(PEN.leds[:, [1, 0, 2]]), "mirror image of the pen (sign of x"),
        (with_leds(PEN.leds / 25.4), "in metres or inches, state the unit"),
        (with_leds(PEN.leds / 10), "too close for discs of 10 mm. Check the unit"),
        (moved(7, 1.0), "LED 7 is"),
    ],
)
def test_a_mistake_in_the_led_file_is_named(
    pen: Pen, named: str, pixels: FloatArray, calibrated: Calibrated
) -> None:
    told, fields = calibrated(pen, pixels)

    assert named in " ".join(told.split())
    assert fields.get("verdict", {}).get("grade") != "pass"


def test_five_dark_leds_are_no_seat_that_varies(calibrated: Calibrated) -> None:
    dark = seen_of(paper_pen())
    dark[:, [1, 3, 4, 6, 8]] = np.nan

    _, fields = calibrated(paper_pen(), dark)

    assert fields["images"]["used"] > 50
    codes = {each["code"] for each in fields["warnings"]}
    assert not {code for code in codes if "seat" in code}
