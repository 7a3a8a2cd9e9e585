"""Causes of a misfit: named if they remove it, and only then."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.causes import cause_of_misfit
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import judge
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), paper_pen()
LAST = np.array(CAMERA.image_size) - 1.0


@pytest.fixture(scope="module")
def pixels() -> FloatArray:
    rng = np.random.default_rng(0)
    swing = swing_poses(60, rng)
    return simulate_centers(CAMERA, PEN, swing.rotations, swing.translations, 0.03, rng)


def exchanged(one: int, other: int) -> Pen:
    leds = PEN.leds.copy()
    leds[[one - 1, other - 1]] = leds[[other - 1, one - 1]]
    return replace(PEN, leds=leds)


def signed(*signs: float) -> Pen:
    return replace(PEN, leds=PEN.leds * np.array(signs))


def moved(led: int, by: float) -> Pen:
    leds = PEN.leds.copy()
    leds[led - 1] += [0.0, by, by]
    return replace(PEN, leds=leds)


@pytest.mark.parametrize(
    ("camera", "pen", "codes"),
    [
        (CAMERA, exchanged(2, 3), {"cause.exchanged"}),
        (CAMERA, exchanged(1, 9), {"cause.exchanged"}),
        (CAMERA, signed(-1, 1, 1), {"cause.mirrored-across"}),
        (CAMERA, signed(1, -1, 1), {"cause.mirrored-across"}),
        (CAMERA, signed(1, 1, -1), {"cause.mirrored-in-z"}),
        (CAMERA, replace(PEN, leds=PEN.leds[:, [1, 0, 2]]), {"cause.mirrored-across"}),
        (CAMERA, moved(7, 0.5), {"cause.moved"}),
        (
            replace(CAMERA, cx=CAMERA.cx + 320, cy=CAMERA.cy - 200),
            PEN,
            {"cause.cropped"},
        ),
    ],
)
def test_a_mistake_in_the_files_is_named(
    camera: Camera, pen: Pen, codes: set[str], pixels: FloatArray
) -> None:
    cause = cause_of_misfit(camera, pen, pixels)

    assert cause is not None
    assert codes <= {part.code for part in cause.parts()}


def test_exchanged_leds_are_named_alone(pixels: FloatArray) -> None:
    cause = cause_of_misfit(CAMERA, exchanged(4, 8), pixels)

    assert str(cause) == (
        "The images agree with the files once this is corrected: "
        "LEDs 4 and 8 are exchanged in the LED file."
    )


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda seen: seen * [-1, 1] + [LAST[0], 0], "cause.images-mirrored"),
        (lambda seen: seen * [1, -1] + [0, LAST[1]], "cause.images-flipped"),
        (lambda seen: seen[..., ::-1], "cause.axes-exchanged"),
        (lambda seen: (seen - 0.5) / 2, "cause.binned"),
        (lambda seen: seen * 2 + 0.5, "cause.not-binned"),
    ],
)
def test_a_change_of_the_images_is_named(change, code, pixels: FloatArray) -> None:  # type: ignore[no-untyped-def]
    cause = cause_of_misfit(CAMERA, PEN, change(pixels))

    assert cause is not None
    assert code in {part.code for part in cause.parts()}


@pytest.mark.slow
def test_nothing_is_named_that_removes_no_misfit(pixels: FloatArray) -> None:
    rng = np.random.default_rng(1)
    noisy = pixels + rng.normal(0, 0.5, pixels.shape)
    wrong = replace(PEN, leds=PEN.leds + rng.normal(0, 2.0, PEN.leds.shape))

    assert cause_of_misfit(CAMERA, PEN, pixels) is None
    assert cause_of_misfit(CAMERA, PEN, noisy) is None
    assert cause_of_misfit(CAMERA, wrong, pixels) is None


@pytest.mark.parametrize("pen", [exchanged(1, 4), signed(-1, 1, 1)])
def test_a_refused_calibration_names_the_cause(pen: Pen, pixels: FloatArray) -> None:
    with pytest.raises(CalibrationError) as info:
        calibrate_pixels(pixels, CAMERA, pen)

    assert info.value.message.values["cause"] == cause_of_misfit(CAMERA, pen, pixels)


def test_a_verdict_names_the_cause_of_a_contradiction(pixels: FloatArray) -> None:
    cropped = pixels - [300, 200]
    found = calibrate_pixels(cropped, CAMERA, PEN)

    verdict = judge(found, SwingLimits(max_uncertainty=1.0))

    assert "cause.cropped" in {part.code for part in verdict.reason.parts()}
