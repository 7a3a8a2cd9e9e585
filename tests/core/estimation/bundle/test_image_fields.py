"""Fields of the images are found and corrected; a good station has none."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import (
    calibrate_pixels,
    simulate_centers,
    simulate_rig_centers,
)
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import FoundField, adjust, found_fields
from lightpen.estimation.bundle.image_fields import FieldName, ImageField, size_of
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import priors_of
from lightpen.estimation.calibrate import Calibration
from lightpen.model.camera import Camera
from lightpen.model.fisheye import LensField
from lightpen.model.limits import USUAL
from lightpen_extensions.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    seen_from,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
N_IMAGES, SIGMA = 120, 0.03
SMALL = {FieldName.LENS: 0.002, FieldName.TILT: 0.003, FieldName.BEND: 0.01}  # px, mm
LARGEST = {FieldName.LENS: 0.08, FieldName.TILT: 0.3, FieldName.BEND: 0.1}  # px, mm


def swing(seed: int = 0) -> tuple[Swing, np.random.Generator]:
    rng = np.random.default_rng([260, seed])
    return swing_poses(N_IMAGES, rng), rng


def calibrated(
    shifts: FloatArray | float = 0.0, seed: int = 0, camera: Camera = CAMERA
) -> tuple[Calibration, FloatArray]:
    """Return a calibration whose images shift, and its error, mm."""
    true, rng = swing(seed)
    pixels = simulate_centers(
        CAMERA, PEN, true.rotations, true.translations, SIGMA, rng
    )
    found = calibrate_pixels(pixels + shifts, camera, PEN)
    return found, found.joint.tip_pen - true.tip_pen


def only(calibration: Calibration, name: FieldName) -> FoundField:
    return next(each for each in calibration.fields if each.name is name)


def lens(pixels: FloatArray, amplitude: float) -> FloatArray:
    """Return two waves over the image that Brown's distortion cannot follow."""
    u, v = pixels[..., 0] / 260.0, pixels[..., 1] / 330.0
    waves = np.stack([np.sin(u + 0.7 * v), np.cos(v - u)], axis=-1)
    return np.asarray(amplitude * np.sqrt(2) * waves)


def test_a_good_station_shows_no_field_and_keeps_its_tip() -> None:
    found, error = calibrated()
    assert not found.fields
    assert (np.abs(error) < found.budget.expanded_uncertainty[:3]).all()


def test_a_lens_field_is_found_and_corrected() -> None:
    true, _ = swing()
    exact = simulate_centers(
        CAMERA, PEN, true.rotations, true.translations, 0.0, np.random.default_rng(0)
    )
    found, error = calibrated(lens(exact, 0.08))
    field = only(found, FieldName.LENS)
    assert 0.05 < field.size < 0.11  # px, rms over u and v
    shifts = found.bundle.lens_shifts(0)
    assert shifts is not None
    used = found.bundle.used[:, 0]
    fitted, true_field = shifts[used], lens(exact, 0.08)[used]
    # A constant and a linear part are a turn of the camera and its focal length.
    columns = np.column_stack([np.ones(len(fitted)), exact[used]])
    off = fitted - true_field
    left = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.4 * np.sqrt(np.mean(true_field**2))
    # What is left of it in the images is hardly more than the noise.
    assert found.joint.sigma < 1.15 * SIGMA
    assert (np.abs(error) < 1.2 * found.budget.expanded_uncertainty[:3]).all()
    assert not found.contradictions


@pytest.mark.slow
def test_a_measured_lens_field_of_the_camera_file_is_corrected() -> None:
    true, _ = swing()
    exact = simulate_centers(
        CAMERA, PEN, true.rotations, true.translations, 0.0, np.random.default_rng(0)
    )
    prior = LensField.of(CAMERA.width, CAMERA.height, 0.05, 300.0)
    nodes = lens(prior.nodes, 0.08)
    field = replace(prior, values=nodes, covariance=1e-4 * prior.covariance)
    known, error = calibrated(field.at(exact), camera=replace(CAMERA, lens_field=field))
    plain, plain_error = calibrated()
    np.testing.assert_allclose(error, plain_error, atol=1e-3)
    assert known.joint.sigma < 1.1 * plain.joint.sigma


def test_a_camera_that_turns_with_the_lean_is_found() -> None:
    true, _ = swing()
    away = true.rotations[:, 2, 1] - true.rotations[:, 2, 1].mean()
    shifts = np.zeros((N_IMAGES, 1, 2))
    shifts[:, 0, 1] = 0.3 * away
    found, error = calibrated(shifts)
    tilt = only(found, FieldName.TILT)
    # RMS over u and v; a part looks like another tip, and so the tip is less certain.
    assert tilt.size == pytest.approx(0.3 * away.std() / np.sqrt(2), rel=0.5)
    assert (np.abs(error) < 1.2 * found.budget.expanded_uncertainty[:3]).all()


def test_a_pen_that_bends_as_it_leans_is_found() -> None:
    """The highest LED falls by 0.06 mm with the pen horizontal."""
    true, rng = swing()
    heights = PEN.leds[:, 1:2] - PEN.leds[:, 1].min()
    fall = true.rotations[:, 1] * [1, 0, 1]  # gravity in the pen, across it
    pixels = []
    for R, T, down in zip(true.rotations, true.translations, fall, strict=True):
        bends = 0.06 * (heights / heights.max()) ** 2 * down
        pen = replace(PEN, leds=PEN.leds + bends)
        pixels.append(simulate_centers(CAMERA, pen, R[None], T[None], SIGMA, rng)[0])
    found = calibrate_pixels(np.array(pixels), CAMERA, PEN)
    bend = only(found, FieldName.BEND)
    assert 0.005 < bend.size < 0.012  # px
    fitted = found.bundle.values[found.bundle.layout.fields[-1]]
    np.testing.assert_allclose(fitted, 0.06, rtol=0.3)


@pytest.mark.parametrize("name", FieldName)
@pytest.mark.parametrize("times", [0.1, 2.0, 5.0, 1e4])
def test_the_fit_is_the_average_over_all_sizes(name: FieldName, times: float) -> None:
    """One unknown is ``times`` its uncertainty off, a hundredth of the largest size."""
    field = ImageField(name, 0, np.zeros((1, 1)), (4 * np.eye(1),))
    noise = 0.01 * LARGEST[name]
    found = size_of(field, np.eye(1) / noise**2, np.array([times / noise]))

    sizes = np.append(0.0, LARGEST[name] * 100.0 ** (np.arange(40) / 39 - 1))
    both = noise**2 + 4 * sizes**2
    seen = times * noise
    costs = np.log(both / noise**2) + seen**2 / both - seen**2 / noise**2
    best = int(np.argmin(costs))
    assert found.sigma == pytest.approx(sizes[best])
    assert found.gain == pytest.approx(-costs[best], rel=1e-9, abs=1e-12)
    none = 0.7 if name is FieldName.TILT else 0.4
    likely = np.exp(-0.5 * (costs - costs.min()))
    likely *= np.append(none, np.full(40, (1 - none) / 40))
    likely /= likely.sum()
    estimates = 4 * sizes**2 / both * seen
    mean = likely @ estimates
    variance = found.covariance[0, 0]
    assert variance / (variance + noise**2) * seen == pytest.approx(mean, rel=1e-6)
    spread = likely @ (estimates - mean) ** 2
    assert found.spread[0, 0] == pytest.approx(spread, rel=1e-6, abs=1e-9 * mean**2)


def test_averages_over_shapes_and_directions_are_those_of_all_models() -> None:
    rng = np.random.default_rng(5)
    shapes = tuple(B @ B.T for B in rng.standard_normal((2, 3, 3)))
    field = ImageField(FieldName.LENS, 0, np.zeros((1, 3)), shapes)
    B = 40 * rng.standard_normal((3, 3))
    S, right = B @ B.T, 30 * rng.standard_normal(3)
    found = size_of(field, S, right)

    sizes = LARGEST[FieldName.LENS] * 100.0 ** (np.arange(40) / 39 - 1)
    # None with either shape, or one of 40 sizes.
    estimates: list[FloatArray] = [np.zeros(3)]
    weights = [2 * 0.4]
    for shape in shapes:
        for size in sizes:
            known = np.linalg.inv(size**2 * shape)
            estimates.append(np.asarray(np.linalg.solve(S + known, right), dtype=float))
            volume = np.linalg.slogdet(np.eye(3) + size**2 * shape @ S)[1]
            likely = right @ estimates[-1] - volume
            weights.append(0.015 * np.exp(0.5 * likely))
    share = np.array(weights) / sum(weights)
    mean = share @ np.array(estimates)
    spread = np.cov(np.array(estimates).T, aweights=share, ddof=0)
    fitted = np.linalg.solve(S + np.linalg.inv(found.covariance), right)
    np.testing.assert_allclose(fitted, mean, rtol=1e-6)
    np.testing.assert_allclose(found.spread, spread, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("name", FieldName)
def test_u_contains_what_a_field_may_be_that_the_images_do_not_show(
    name: FieldName,
) -> None:
    """A tip is covered beside a field that is too small to be reported."""
    plain, _ = calibrated()
    (number,) = (
        i for i, each in enumerate(plain.bundle.unknowns.fields) if each.name is name
    )
    field = plain.bundle.unknowns.fields[number]
    rng = np.random.default_rng(7)
    values = SMALL[name] * field.roots[-1] @ rng.standard_normal(field.number)
    moved, error = calibrated(field.columns[:, 0] @ values)

    assert not moved.fields
    assert (np.abs(error) < moved.budget.expanded_uncertainty[:3]).all()


def test_what_a_file_states_of_its_lens_is_taken_as_it_is() -> None:
    field = ImageField(FieldName.LENS, 0, np.zeros((1, 2)), (np.eye(2),), is_exact=True)
    found = size_of(field, np.eye(2), np.array([9.0, 9.0]))
    np.testing.assert_array_equal(found.covariance, np.eye(2))
    assert not found.spread.any()


@pytest.mark.parametrize(
    ("name", "code"),
    [
        (FieldName.LENS, "warning.lens-field"),
        (FieldName.TILT, "warning.camera-tilt"),
        (FieldName.BEND, "warning.pen-bends"),
    ],
)
def test_each_field_has_a_message_that_names_its_camera_if_it_has_one(
    name: FieldName, code: str
) -> None:
    field = FoundField(name, "", 0.02, 50.0)
    finding = field.message

    assert (finding.code, finding.values) == (code, {"size": 0.02})
    of_camera = replace(field, camera="right").message
    assert of_camera.code == "rig.of-camera"
    assert of_camera.values == {"camera": "right", "fault": finding}


def test_a_tilt_is_found_of_the_camera_that_tilts() -> None:
    rng = np.random.default_rng(3)
    row, pen = row_of_cameras(2, 1000.0), replace(paper_pen(), led_sigma=0.002)
    rig = from_first(row)
    true = seen_from(swing_poses(40, rng), row.rotations[0], row.translations[0])
    pixels = simulate_rig_centers(rig, pen, true, 0.03, rng)
    pixels[:, 1, :, 0] += 0.8 * true.rotations[:, 2, 1, None]
    state = BundleState(rig, pen, true.tip_pen, true.cone_cam, true.rotations)
    bundle = adjust(state, pixels, priors_of(rig, pen, USUAL)).bundle

    found = found_fields(bundle)

    gains = [each.gain for each in found]
    assert gains == sorted(gains, reverse=True)
    tilt = found[0]
    assert (tilt.name, tilt.camera) == (FieldName.TILT, "right")
    spread = 0.8 * true.rotations[:, 2, 1].std() / np.sqrt(2)
    assert tilt.size == pytest.approx(spread, rel=0.4)
