"""Tests of `lightpen_extensions.measure.tasks.probed_point`."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from benchmarks.touches import covered_share
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.pose import fit_poses
from lightpen.detection.reasons import Reason
from lightpen.estimation.pivot.pivot import median_distance, outlier_distance
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen_extensions.measure.tasks.probed_point import (
    SEATING,
    ProbedPoint,
    ProbingFrame,
    StillFrames,
    _agreeing,
    _mean_noise,
    _pooled_sigma,
    joint_covariance,
    measure_touches,
    point_sensitivities,
    with_tip,
)
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP

Touching = Callable[..., tuple[ProbedPoint, ...]]


def test_exact_images_give_the_exact_point(instrument: Instrument) -> None:
    R = np.diag([1.0, -1.0, -1.0])
    t = PAPER_CONE - R @ PAPER_TIP
    rng = np.random.default_rng(0)
    pixels = simulate_centers(
        instrument.camera, instrument.pen, R[None], t[None], 0.0, rng
    )

    (touch,) = measure_touches(
        instrument, [StillFrames((ProbingFrame("one", pixels, R, t),))]
    )

    np.testing.assert_allclose(touch.point_cam, PAPER_CONE, atol=1e-6)


def test_a_point_follows_the_parameters_as_its_derivative_says(
    instrument: Instrument,
) -> None:
    R = np.diag([1.0, -1.0, -1.0])
    t = PAPER_CONE - R @ PAPER_TIP
    rng = np.random.default_rng(0)
    pixels = simulate_centers(
        instrument.camera, instrument.pen, R[None], t[None], 0.0, rng
    )
    at = instrument.parameters

    def point(fx: float, scale: float, diameter: float) -> FloatArray:
        camera = replace(instrument.camera, fx=instrument.camera.fx + fx)
        pen = replace(
            instrument.pen,
            leds=(1 + scale) * instrument.pen.leds,
            diameter=instrument.pen.diameter + diameter,
        )
        poses = fit_poses(camera, pen, pixels, R[None], t[None])
        return np.asarray(poses.rotations[0] @ PAPER_TIP + poses.translations[0])

    poses = fit_poses(instrument.camera, instrument.pen, pixels, R[None], t[None])
    (derivative,) = point_sensitivities(instrument, poses)
    by_scale = derivative[:, at.leds] @ instrument.pen.leds.ravel()
    # No image depends on the tip, which goes with the pen.
    np.testing.assert_allclose(derivative[:, at.tip], R, atol=1e-6)
    for by_this, step in (
        (derivative[:, at.cameras[0].start], (0.1, 0.0, 0.0)),
        (by_scale, (0.0, 1e-4, 0.0)),
        (derivative[:, at.diameter.start], (0.0, 0.0, 0.1)),
    ):
        back = [-part for part in step]
        difference = (point(*step) - point(*back)) / (2 * max(step))
        size = float(np.abs(difference).max())
        # The Jacobian is that of projected centres, and weights follow the residuals.
        # A disc that faces the camera is seen as a circle: its diameter moves nothing.
        tolerance = 0.05 * size + 1e-12
        np.testing.assert_allclose(by_this, difference, atol=tolerance)


def test_more_images_make_a_point_less_noisy(touching: Touching) -> None:
    one = touching(PAPER_CONE[None], n_frames=1)[0]
    many = touching(PAPER_CONE[None], n_frames=25)[0]

    by_images = [np.trace(each.noise - SEATING**2 * np.eye(3)) for each in (one, many)]
    ratio = by_images[0] / by_images[1]
    assert ratio == pytest.approx(25, rel=0.3)  # the noise itself is estimated


def test_images_that_scatter_by_more_than_their_noise_make_a_point_less_certain(
    instrument: Instrument,
) -> None:
    R = np.diag([1.0, -1.0, -1.0])
    rng = np.random.default_rng(0)
    t = PAPER_CONE - R @ PAPER_TIP + 0.05 * rng.standard_normal((25, 3))
    pixels = simulate_centers(
        instrument.camera, instrument.pen, np.tile(R, (25, 1, 1)), t, 0.01, rng
    )
    frames = tuple(
        ProbingFrame(f"image {i}", each[None], R, t[i]) for i, each in enumerate(pixels)
    )

    (touch,) = measure_touches(instrument, [StillFrames(frames)])

    # Along the view the noise is as large as the scatter.
    across = np.sqrt(np.diag(touch.noise))[:2]
    assert (across > 0.5 * 0.05 / np.sqrt(25)).all()


def test_an_image_that_slipped_is_left_out_and_named(instrument: Instrument) -> None:
    R = np.diag([1.0, -1.0, -1.0])
    t = np.tile(PAPER_CONE - R @ PAPER_TIP, (6, 1))
    t[4, 0] += 1.0
    rng = np.random.default_rng(0)
    pixels = simulate_centers(
        instrument.camera, instrument.pen, np.tile(R, (6, 1, 1)), t, 0.01, rng
    )
    frames = tuple(
        ProbingFrame(f"image {i}", each[None], R, t[i]) for i, each in enumerate(pixels)
    )

    (touch,) = measure_touches(instrument, [StillFrames(frames)])

    assert [each.name for each in touch.rejected] == ["image 4"]
    assert touch.rejected[0].reason is Reason.SLIPPED
    assert "image 4" not in touch.names
    # Depth is the noisiest coordinate: some 15 um an image.
    np.testing.assert_allclose(touch.point_cam, PAPER_CONE, atol=0.05)


def test_what_touches_share_drops_out_of_their_difference(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(np.tile(PAPER_CONE, (2, 1)), tilt=0.0)
    covariance = joint_covariance(touches, instrument)
    D = np.hstack([np.eye(3), -np.eye(3)])

    alone = touches[0].covariance(instrument) + touches[1].covariance(instrument)
    together = D @ covariance @ D.T

    assert np.trace(together) < 0.1 * np.trace(alone)
    np.testing.assert_allclose(covariance[:3, :3], touches[0].covariance(instrument))


def test_another_tip_moves_the_point_with_the_pen(
    instrument: Instrument, touching: Touching
) -> None:
    (touch,) = touching(PAPER_CONE[None])
    moved = with_tip(touch, instrument, PAPER_TIP + np.array([0.0, 0.0, 1.0]))

    np.testing.assert_allclose(moved.point_cam - touch.point_cam, touch.rotation[:, 2])


@pytest.mark.parametrize("n", [2, 4, 10])
@pytest.mark.parametrize("by", [0.99, 1.01])
def test_a_mean_scatters_by_more_than_its_noise_once_in_a_hundred_times(
    n: int, by: float
) -> None:
    sigma = np.diag([0.1, 0.2, 0.4])
    by_chance = 1 + 2.33 * np.sqrt(2 / (3 * (n - 1)))  # of chi-square over its freedom
    step = np.sqrt(by * by_chance * 3 * (n - 1) / n)  # deviations
    points = step * (-1.0) ** np.arange(n)[:, None] * sigma[1] + 5.0

    found = _mean_noise(points, np.tile(sigma**2, (n, 1, 1)))

    excess = by * by_chance if by > 1 else 1.0
    np.testing.assert_allclose(found, excess * sigma**2 / n)
    np.testing.assert_array_equal(_mean_noise(points[:1], sigma[None]), sigma)


@pytest.mark.parametrize(
    ("scatter", "unit"), [(0.5, 1.0), (5.0, 5.0 / median_distance())]
)
@pytest.mark.parametrize(("by", "agrees"), [(0.99, True), (1.01, False)])
def test_an_image_agrees_within_the_noise_or_the_scatter_of_its_touch(
    scatter: float, unit: float, by: float, agrees: bool
) -> None:
    """Of images that lie as many deviations off as said, to all sides."""
    off = by * outlier_distance() * unit
    steps = scatter * np.array([1, -1, 1, -1, 1, -1, 1, -1])
    points = 0.1 * np.outer([*steps, off, -off], [0.0, 1.0, 0.0])
    found = _agreeing(points, np.tile(0.01 * np.eye(3), (10, 1, 1)))

    assert found == [*range(10 if agrees else 8)]


@pytest.mark.parametrize(
    ("n_leds", "n_images", "freedom"), [(8, 10, 100), (4, 2, 4), (3, 5, 0), (2, 5, 0)]
)
def test_the_noise_is_that_of_the_images_and_of_thirty_freedoms_of_the_calibration(
    instrument: Instrument, n_leds: int, n_images: int, freedom: int
) -> None:
    """Six unknowns of a pose are no freedom."""
    weights = np.zeros((n_images, 10))
    weights[:, :n_leds] = 0.5
    poses: Any = SimpleNamespace(
        weights=weights, rotations=np.zeros((n_images, 3, 3)), sigma=0.07
    )
    squares = freedom * 0.07**2 + 30 * instrument.sigma**2
    expected = np.sqrt(squares / (freedom + 30))
    assert _pooled_sigma(instrument, poses) == pytest.approx(expected)


@pytest.mark.slow
def test_ellipsoids_hold_the_true_point_as_often_as_they_say() -> None:
    # What is wrong of a calibration is wrong of all its touches: eight count, and three
    # standard deviations below 95 % of eight are 72 %. The benchmark has a hundred.
    share = covered_share(n_calibrations=8, n_touches=4, seed=2)

    assert share > 0.72
