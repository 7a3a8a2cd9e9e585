"""What to do about LEDs that are too dark or too bright."""

from dataclasses import replace

import pytest

from lightpen.cameras.protocol import CameraCapabilities, CameraSettings, Range
from lightpen.detection.inspection import LONGEST_EXPOSURE_US, Advice, Exposure, advise

CAPS = CameraCapabilities(
    *(2448, 2048, ("Mono8",)),
    exposure_us=Range(10.0, 50_000.0),
    gain_db=Range(0.0, 24.0),
)
RECORDED = replace(CAPS, exposure_us=None, gain_db=None)
USUAL = CameraSettings(exposure_us=1000.0, gain_db=0.0)
DARK, GOOD, BRIGHT = Exposure((0.1, 0.5)), Exposure((0.5, 0.6)), Exposure((1.0, 0.6))


@pytest.mark.parametrize(
    ("exposure", "settings", "advice"),
    [
        (Exposure(), USUAL, Advice.SHOW_PEN),
        (GOOD, USUAL, Advice.LEAVE),
        (BRIGHT, USUAL, Advice.SHORTEN_EXPOSURE),
        (BRIGHT, replace(USUAL, gain_db=6.0), Advice.LOWER_GAIN),
        (BRIGHT, replace(USUAL, exposure_us=10.0), Advice.CLOSE_APERTURE),
        (DARK, USUAL, Advice.LENGTHEN_EXPOSURE),
        (DARK, replace(USUAL, exposure_us=LONGEST_EXPOSURE_US), Advice.RAISE_GAIN),
        (
            DARK,
            CameraSettings(exposure_us=50_000.0, gain_db=24.0),
            Advice.OPEN_APERTURE,
        ),
        (Exposure((0.1, 1.0)), USUAL, Advice.EVEN_OUT),
    ],
)
def test_the_cheapest_remedy_comes_first(
    exposure: Exposure, settings: CameraSettings, advice: Advice
) -> None:
    assert advise(exposure, settings, CAPS) is advice


@pytest.mark.parametrize("caps", [RECORDED, None])
def test_what_cannot_be_set_is_left_to_the_lens(
    caps: CameraCapabilities | None,
) -> None:
    assert advise(BRIGHT, CameraSettings(), caps) is Advice.CLOSE_APERTURE
    assert advise(DARK, CameraSettings(), caps) is Advice.OPEN_APERTURE


def test_a_camera_with_gain_alone_is_helped_by_gain() -> None:
    caps = replace(CAPS, exposure_us=None)

    assert advise(DARK, CameraSettings(gain_db=0.0), caps) is Advice.RAISE_GAIN
    assert advise(BRIGHT, CameraSettings(gain_db=3.0), caps) is Advice.LOWER_GAIN
