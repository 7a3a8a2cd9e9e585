"""Calibrations of the images that pen and camera were found from."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_stations import errors_of, random_station, seen_again

from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.formats.camera_files import read_camera
from lightpen.formats.observation_files import Centers
from lightpen.formats.pen_files import read_pen, write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.scale import MeasuredLength
from lightpen_extensions.discover.starts import gradient_of

STATION = random_station(6, n_images=60)
SIGMA_LENGTH = 0.02  # mm


@pytest.fixture(scope="module")
def found() -> Discovery:
    length = MeasuredLength(None, STATION.longest, SIGMA_LENGTH)
    return discover(STATION.sightings, replace(STATION.request, lengths=(length,)))


@pytest.fixture
def files(found: Discovery, tmp_path: Path) -> tuple[Camera, Pen]:
    write_camera(found.camera, tmp_path / "camera.yaml")
    write_pen(found.pen, tmp_path / "pen.json")
    return read_camera(tmp_path / "camera.yaml"), read_pen(tmp_path / "pen.json")


@pytest.fixture
def calibrated(found: Discovery) -> Callable[..., Calibration]:
    """Return a function that calibrates the tip by centres (N, L, 2) of the station."""
    order = np.argsort(errors_of(found, STATION).order)

    def calibrated_by(camera: Camera, pen: Pen, pixels: np.ndarray) -> Calibration:
        numbers = np.arange(len(pixels))
        centers = Centers(numbers, pixels[:, order], Path("centers.csv"))
        return calibrate(camera, pen, observe_centers(centers, camera, pen))

    return calibrated_by


def warned(calibration: Calibration) -> bool:
    return "warning.own-images" in [each.code for each in warnings_of(calibration)]


def sigmas(calibration: Calibration) -> np.ndarray:
    return np.sqrt(np.diag(calibration.instrument.covariance)[:3])


def test_the_same_images_count_once(
    found: Discovery, files: tuple[Camera, Pen], calibrated: Callable[..., Calibration]
) -> None:
    camera, pen = files
    once = calibrated(camera, pen, STATION.pixels)
    measured = replace(camera, found=None), replace(pen, found=None)
    twice = calibrated(*measured, STATION.pixels)

    assert warned(once)
    assert not warned(twice)
    own = np.sqrt(np.diag(found.covariance)[:3] - np.diag(found.beyond_fit))
    # Image noise is estimated anew, to a part in a hundred.
    np.testing.assert_allclose(sigmas(once), own, rtol=0.03)
    np.testing.assert_allclose(once.joint.tip_pen, found.tip_pen, atol=0.2 * own.min())
    assert (sigmas(twice) < 0.9 * own).any()


@pytest.mark.parametrize("is_camera", [True, False])
def test_either_file_tells_that_the_images_are_its_own(
    files: tuple[Camera, Pen], calibrated: Callable[..., Calibration], is_camera: bool
) -> None:
    camera, pen = files
    if is_camera:
        pen = replace(pen, found=None)
    else:
        camera = replace(camera, found=None)

    assert warned(calibrated(camera, pen, STATION.pixels))


def test_a_part_of_the_images_is_recognised_and_other_images_are_not(
    files: tuple[Camera, Pen], calibrated: Callable[..., Calibration]
) -> None:
    other = seen_again(STATION, 60, 0.03, np.random.default_rng(1)).pixels

    assert warned(calibrated(*files, np.concatenate([other, STATION.pixels[::5]])))
    assert not warned(calibrated(*files, other))


def test_the_frame_of_the_pen_is_that_of_what_was_known_before(
    found: Discovery,
) -> None:
    (length,) = found.lengths

    row = gradient_of(found.pen.leds, length)
    assert found.pen.found is not None
    sigma = np.sqrt(row @ found.pen.found.led_covariance @ row)
    assert sigma == pytest.approx(SIGMA_LENGTH, rel=0.01)


def test_the_length_gives_the_uncertainty_of_the_scale(found: Discovery) -> None:
    sigma, of_leds = found.pen.scale_sigma, found.pen.led_covariance
    assert sigma is not None
    assert of_leds is not None
    assert sigma == pytest.approx(SIGMA_LENGTH / STATION.longest, rel=0.05)
    whole = found.covariance[found.parameters.leds, found.parameters.leds]
    scaling = (found.pen.leds - found.pen.leds.mean(axis=0)).ravel()
    by_scale = sigma**2 * np.outer(scaling, scaling)
    np.testing.assert_allclose(np.diag(of_leds + by_scale), np.diag(whole), rtol=0.1)
