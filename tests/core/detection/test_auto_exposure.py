"""The exposure by the LEDs, on a simulated camera that closes the loop."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from lightpen.cameras.protocol import CameraCapabilities, CameraSettings, Frame, Range
from lightpen.detection.inspection import (
    LONGEST_EXPOSURE_US,
    MAX_BLIND,
    TARGET,
    AutoExposure,
    ExposureState,
    inspect,
)
from lightpen.detection.pen_detection import detect_pen
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_camera

SCENE = Scene(camera=paper_camera(binning=2))


class Loop:
    """A simulated camera and who sets it by the LEDs."""

    def __init__(
        self, scene: Scene = SCENE, settings: CameraSettings | None = None
    ) -> None:
        self.scene = scene
        self.camera = SimulatedCamera(scene, SkippingClock())
        self.camera.open()
        self.settings = self.camera.configure(settings or CameraSettings())
        self.camera.start()
        self.limits = CameraCapabilities(0, 0, ())
        self.frame: Frame | None = None

    def run(self, caps: CameraCapabilities | None = None) -> AutoExposure:
        """Adjust until there is an outcome."""
        caps = caps or self.camera.caps
        now = AutoExposure.begun(self.settings)
        for _ in range(100):
            self.frame = frame = self.camera.read(1.0)
            scene = self.scene
            seen = detect_pen(
                *(frame.image, scene.camera, scene.pen, None, None, frame.full_scale)
            )
            assert seen.spots is not None
            before = now
            now = now.after(frame, seen.spots, inspect(seen.spots, seen.labels), caps)
            if now.outcome is not ExposureState.ADJUSTING:
                return now
            if now.asked != before.asked:
                self.camera.set_exposure(now.asked.exposure_us or 0.0)
                self.camera.set_gain(now.asked.gain_db or 0.0)
        pytest.fail(f"There was no outcome: {now}.")


@pytest.mark.parametrize(
    ("exposure_us", "bits"), [(150.0, 8), (1000.0, 12), (4000.0, 8), (40_000.0, 8)]
)
def test_the_brightest_led_comes_to_80_percent_and_none_is_saturated(
    exposure_us: float, bits: Literal[8, 12]
) -> None:
    settings = CameraSettings(exposure_us=exposure_us, pixel_format=f"Mono{bits}")
    loop = Loop(settings=settings)
    loop.camera.operator.seat()
    found = loop.run()

    assert found.outcome is ExposureState.DONE
    assert found.level == pytest.approx(TARGET, abs=0.05)
    assert loop.frame is not None
    assert loop.frame.image.max() < loop.frame.full_scale
    assert found.asked.gain_db == 0.0
    assert (found.asked.exposure_us or 0.0) <= LONGEST_EXPOSURE_US


def test_gain_does_what_a_longer_exposure_would_smear() -> None:
    dim = replace(SCENE, optics=replace(SCENE.optics, exposure=0.05))
    loop = Loop(dim)
    loop.camera.operator.seat()
    found = loop.run()

    assert found.outcome is ExposureState.DONE
    assert found.asked.exposure_us == LONGEST_EXPOSURE_US
    assert (found.asked.gain_db or 0.0) > 3
    assert found.level == pytest.approx(TARGET, abs=0.05)


def test_leds_that_stay_too_dark_or_too_bright_are_said_to_be() -> None:
    for exposure_us, offered, outcome in (
        (100.0, Range(10, 300), ExposureState.TOO_DARK),
        (5000.0, Range(3500, 50_000), ExposureState.TOO_BRIGHT),
    ):
        loop = Loop(settings=CameraSettings(exposure_us=exposure_us))
        loop.camera.operator.seat()
        caps = replace(loop.camera.caps, exposure_us=offered, gain_db=None)
        assert loop.run(caps).outcome is outcome


def test_the_least_light_that_saturates_is_remembered() -> None:
    loop = Loop(settings=CameraSettings(exposure_us=4000.0))
    loop.camera.operator.seat()
    for _ in range(40):  # until it is seated
        frame = loop.camera.read(1.0)
        seen = detect_pen(frame.image, SCENE.camera, SCENE.pen)
        assert seen.spots is not None
        leds = inspect(seen.spots, seen.labels)
        if leds.exposure.n_saturated:
            break
    assert leds.exposure.n_saturated
    assert seen.spots is not None
    begun = AutoExposure.begun(loop.settings)

    for known, least in ((np.inf, 4000.0), (5000.0, 4000.0), (3000.0, 3000.0)):
        now = replace(begun, saturating=known)
        now = now.after(frame, seen.spots, leds, loop.camera.caps)
        assert now.saturating == pytest.approx(least)


def test_without_leds_it_gives_up_and_changes_nothing() -> None:
    loop = Loop()
    found = loop.run()

    assert found.outcome is ExposureState.NO_LEDS
    assert found.n_blind == MAX_BLIND
    assert found.asked.exposure_us == loop.settings.exposure_us


def test_images_of_another_exposure_are_passed_over() -> None:
    loop = Loop()
    loop.camera.operator.seat()
    now = AutoExposure.begun(CameraSettings(exposure_us=77.0, gain_db=0.0))
    frame = loop.camera.read(1.0)
    spots = detect_pen(frame.image, SCENE.camera, SCENE.pen).spots
    assert spots is not None

    assert now.after(frame, spots, inspect(spots), loop.camera.caps) is now
    assert np.isinf(now.saturating)
