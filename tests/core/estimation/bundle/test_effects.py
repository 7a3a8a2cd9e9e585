"""Effects of lens and mechanics are found, and cost nothing where they are not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.bundle.effect_findings import FoundEffect
from lightpen.estimation.bundle.effects import (
    Effect,
    EffectName,
    cone_moves,
    gain_of,
    mechanics_of,
    size_of,
)
from lightpen.estimation.bundle.linearised import BundleState, views_at
from lightpen.estimation.bundle.seat_modes import axes_of_cone
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.formats.observation_files import Centers
from lightpen.model.camera import Camera
from lightpen.model.lens_field import LensField
from lightpen.model.rig import rig_of
from lightpen.model.rigid import rotation_from_vector
from lightpen.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
N_IMAGES, SIGMA = 120, 0.03


def swing(seed: int = 0) -> tuple[Swing, np.random.Generator]:
    rng = np.random.default_rng([260, seed])
    return swing_poses(N_IMAGES, rng), rng


def lean_of(R: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the mean pen axis, and each pen's axis across it, (N, 3)."""
    along = R[:, :, 1].mean(axis=0)
    along = along / np.linalg.norm(along)
    axes = R[:, :, 1]
    return along, axes - (axes @ along)[:, None] * along


def calibrated(
    moves: FloatArray | float = 0.0,
    shifts: FloatArray | float = 0.0,
    seed: int = 0,
    camera: Camera = CAMERA,
) -> tuple[Calibration, FloatArray]:
    """Return a calibration whose tip moves and images shift, and its error, mm."""
    true, rng = swing(seed)
    pixels = simulate_centers(
        CAMERA, PEN, true.rotations, true.translations + moves, SIGMA, rng
    )
    centers = Centers(np.arange(N_IMAGES), pixels + shifts, Path("simulated"))
    found = calibrate(camera, PEN, observe_centers(centers, camera, PEN))
    return found, found.joint.tip_pen - true.tip_pen


def only(calibration: Calibration, name: EffectName) -> FoundEffect:
    return next(each for each in calibration.effects if each.name is name)


def across_pens(R: FloatArray) -> FloatArray:
    """Return the mean pen axis across each pen, (N, 3)."""
    along, _ = lean_of(R)
    axes = R[:, :, 1]
    return along - (axes @ along)[:, None] * axes


def lens(pixels: FloatArray, amplitude: float) -> FloatArray:
    """Return two waves over the image that Brown's distortion cannot follow."""
    u, v = pixels[..., 0] / 260.0, pixels[..., 1] / 330.0
    waves = np.stack([np.sin(u + 0.7 * v), np.cos(v - u)], axis=-1)
    return np.asarray(amplitude * np.sqrt(2) * waves)


def test_a_good_station_shows_no_effect_and_keeps_its_tip() -> None:
    found, error = calibrated()
    assert not [each for each in found.effects if each.is_certain]
    assert (np.abs(error) < found.budget.expanded_uncertainty[:3]).all()


def test_a_lens_field_is_found_and_corrected() -> None:
    true, _ = swing()
    exact = simulate_centers(
        CAMERA, PEN, true.rotations, true.translations, 0.0, np.random.default_rng(0)
    )
    found, error = calibrated(shifts=lens(exact, 0.08))
    field = only(found, EffectName.LENS)
    assert field.is_certain
    assert 0.05 < field.size < 0.11  # px, rms over u and v
    assert field.message.code == "warning.effect-lens"
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
    known, error = calibrated(
        shifts=field.at(exact), camera=replace(CAMERA, lens_field=field)
    )
    plain, plain_error = calibrated()
    np.testing.assert_allclose(error, plain_error, atol=1e-3)
    assert known.joint.sigma < 1.1 * plain.joint.sigma


def test_compliance_is_an_unknown_along_the_pen() -> None:
    true, _ = swing()
    _, across = lean_of(true.rotations)
    found, error = calibrated(moves=0.06 * across)
    given_way = only(found, EffectName.COMPLIANCE)
    assert given_way.sigma is not None
    assert abs(given_way.size - 0.06) < 3 * given_way.sigma
    assert abs(error[1]) < found.budget.expanded_uncertainty[1]


@pytest.mark.parametrize("seed", range(3))
def test_usual_mechanics_together_are_allowed_for(seed: int) -> None:
    true, _ = swing(seed)
    across = across_pens(true.rotations)
    play = across / np.linalg.norm(across, axis=1, keepdims=True)
    shift = 0.02 * true.rotations[:, :, 1][:, ::2]
    moves = 0.006 * across + 0.006 * play
    found, error = calibrated(moves=moves, shifts=shift[:, None], seed=seed)
    good, _ = calibrated(seed=seed)
    assert (np.abs(error) < found.budget.expanded_uncertainty[:3]).all()
    # Mechanics that are perfect are not followed, and allowed for all the same.
    tip = good.bundle.values[good.bundle.layout.effects[0]]
    np.testing.assert_allclose(tip, 0.0, atol=1e-6)
    assert ContributionName.SAG in {share.name for share in good.budget.shares}


def test_a_stylus_that_jumps_with_the_side_of_the_lean_is_found() -> None:
    true, _ = swing()
    _, across = lean_of(true.rotations)
    sides = across / np.linalg.norm(across, axis=1, keepdims=True)
    found, error = calibrated(moves=0.015 * sides)
    loose = only(found, EffectName.LOOSE)
    assert loose.is_certain
    assert 0.008 < loose.size < 0.022
    assert (np.abs(error) < 1.2 * found.budget.expanded_uncertainty[:3]).all()


@pytest.mark.slow
def test_a_camera_that_turns_with_the_lean_is_found() -> None:
    true, _ = swing()
    _, across = lean_of(true.rotations)
    shifts = np.zeros((N_IMAGES, 1, 2))
    shifts[..., 1] = 0.3 * across[:, 2:]
    found, error = calibrated(shifts=shifts)
    assert only(found, EffectName.TILT).size == pytest.approx(0.3, abs=0.15)
    assert (np.abs(error) < 1.2 * found.budget.expanded_uncertainty[:3]).all()


def test_what_is_assumed_of_compliance_counts_where_the_images_hardly_show_it() -> None:
    found, _ = calibrated()
    shares = {share.name: share for share in found.budget.shares}
    assert shares[ContributionName.COMPLIANCE].assumed
    # As large as assumed at most: the tip goes along the pen by about as much.
    assert 0.001 < shares[ContributionName.COMPLIANCE].standard_uncertainty[1] < 0.006


def test_the_size_of_an_effect_is_found_by_likelihood() -> None:
    rng = np.random.default_rng(5)
    S = np.diag(np.full(8, 1e7))  # a standard deviation of 0.3 um each
    columns = np.zeros((1, 8))
    effect = Effect(EffectName.SAG, 0, columns, (np.eye(8),))
    none = size_of(effect, S, rng.normal(size=8) * np.sqrt(1e7))
    assert none.gain < 6.6
    moved = rng.normal(0, 0.004, 8)
    found = size_of(effect, S, S @ moved)
    assert found.sigma == pytest.approx(float(np.sqrt(np.mean(moved**2))), rel=0.15)
    assert found.gain > 50


def test_mechanics_gain_as_much_as_they_make_the_images_likelier() -> None:
    rng = np.random.default_rng(7)
    S, prior = np.diag([1e8, 1e6, 1e4]), np.diag([1e-8, 1e-6, 1e-6])
    right, means = S @ rng.normal(0, 2e-3, 3), np.array([1e-4, 0.0, 2e-3])
    # As if each unknown were seen by itself: its value has the variance of both.
    seen, noise = right / np.diag(S), 1 / np.diag(S)
    both = noise + np.diag(prior)
    misfit = (seen - means) ** 2 / both
    expected = np.sum(seen**2 / noise - misfit - np.log(both / noise))
    assert gain_of(S, right, prior, means) == pytest.approx(float(expected))
    assert gain_of(S, np.zeros(3), prior, means) < 0


def test_play_and_sag_are_expected_downward_with_their_usual_mean_square() -> None:
    columns, shapes = np.zeros((1, 3)), tuple(np.diag(one) for one in np.eye(3))
    play = Effect(EffectName.LOOSE, 0, columns, shapes, 0.005)
    drawn = np.abs(np.random.default_rng(3).normal(0, 0.005 / np.sqrt(3), 100_000))
    assert play.mean[0] == pytest.approx(drawn.mean(), rel=0.01)
    assert play.prior[0, 0] == pytest.approx(drawn.var(), rel=0.02)
    assert (play.mean[1:] == 0).all()
    assert np.diag(play.prior)[1:] == pytest.approx(0.005**2 / 3)
    assert (play.at_zero.mean == 0).all()


LARGEST = {  # mm, px or image intervals
    EffectName.LENS: 0.08, EffectName.COMPLIANCE: 0.03, EffectName.LOOSE: 0.01,
    EffectName.SAG: 0.03, EffectName.TILT: 0.1, EffectName.DELAY: 0.5,
    EffectName.SHUTTER: 1.0, EffectName.STROBE: 0.1,
}  # fmt: skip


@pytest.mark.parametrize("name", EffectName)
@pytest.mark.parametrize("times", [0.1, 2.0, 5.0, 1e6])
def test_the_size_of_one_unknown_is_that_of_its_likelihood(
    name: EffectName, times: float
) -> None:
    """It is seen ``times`` its uncertainty off, which is a hundredth of the largest."""
    largest, stated = LARGEST[name], 0.3 * LARGEST[name]
    effect = Effect(name, 0, np.zeros((1, 1)), (4 * np.eye(1),), stated)
    noise = 0.01 * largest
    found = size_of(effect, np.eye(1) / noise**2, np.array([times / noise]))

    sizes = largest * 1000.0 ** (np.arange(60) / 59 - 1)
    both = noise**2 + 4 * sizes**2
    seen = times * noise
    costs = np.log(both / noise**2) + seen**2 / both - seen**2 / noise**2
    best = int(np.argmin(costs))
    assert found.sigma == pytest.approx(sizes[best])
    assert found.gain == pytest.approx(-costs[best], rel=1e-9, abs=1e-12)
    assert found.covariance[0, 0] == pytest.approx(4 * sizes[best] ** 2)
    assert found.is_supported == (-costs[best] > 6.6349)
    if effect.is_mechanical:
        mean_square = 4 * stated**2
        half = name in (EffectName.LOOSE, EffectName.SAG)
        known = mean_square * (1 - 2 / np.pi) if half else mean_square
        assert found.expected[0, 0] == pytest.approx(known)
        return
    likely = 0.3 / 60 * np.exp(-0.5 * (costs - costs.min()))
    likely /= likely.sum() + 0.7 * np.exp(0.5 * costs.min())
    squares = 4 * sizes**2
    if name is not EffectName.LENS:  # of timing, given the images
        share = squares / both
        squares = share * noise**2 + (share * seen) ** 2
    assert found.expected[0, 0] == pytest.approx(np.sum(likely * squares))


def test_usual_mechanics_have_their_usual_sizes() -> None:
    true, _ = swing()
    state = BundleState(
        rig_of(CAMERA), PEN, true.tip_pen, true.cone_cam, true.rotations
    )
    views = views_at(state, np.zeros((N_IMAGES, 1, 10, 2)))
    mechanics = mechanics_of(
        views, true.rotations, axes_of_cone(true.rotations), PEN.leds, 0.004
    )
    usual = {each.name: each.stated for each in mechanics}
    shapes = {each.name: np.array(each.shapes) for each in mechanics}

    assert usual == {
        EffectName.COMPLIANCE: 0.004,
        EffectName.LOOSE: 0.005,
        EffectName.SAG: 0.012,
        EffectName.TILT: 0.01,
    }
    np.testing.assert_array_equal(shapes[EffectName.COMPLIANCE], [0.5 * np.eye(2)])
    loose = [np.diag(one) for one in np.eye(3)]
    np.testing.assert_array_equal(shapes[EffectName.LOOSE], loose)
    np.testing.assert_array_equal(shapes[EffectName.SAG], [np.eye(1)])
    np.testing.assert_array_equal(shapes[EffectName.TILT], [np.eye(4)])
    assert not any(each.is_exact or each.camera for each in mechanics)


def test_moves_of_the_tip_are_those_of_a_lean_in_one_plane() -> None:
    """The pen leans by an angle to the right; its y axis is that of the cone."""
    angles = np.array([0.3, 0.1, 0.005, -0.2])
    turns = rotation_from_vector(np.outer(-angles, [0.0, 0.0, 1.0]))
    axes = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]])
    found = cone_moves(turns, axes)

    sine, cosine = np.sin(angles), np.cos(angles)
    nothing = np.zeros(4)
    np.testing.assert_allclose(found.lean, np.stack([sine, nothing], 1), atol=1e-15)
    # Across the pen, of its axis and that of the cone; and across the cone.
    across = np.stack([-sine * cosine, sine**2, nothing], axis=1)
    np.testing.assert_allclose(found.compliance[..., 0], across, atol=1e-15)
    side = np.stack([sine, nothing, nothing], axis=1)
    np.testing.assert_allclose(found.compliance[..., 1], side, atol=1e-15)
    size = np.maximum(np.abs(sine), 0.02)[:, None]
    np.testing.assert_allclose(found.loose[..., 0], across / size, atol=1e-15)
    jump = np.tanh(sine / 0.02)[:, None] * turns[:, :, 0]
    np.testing.assert_allclose(found.loose[..., 1], jump, atol=1e-15)
    np.testing.assert_allclose(found.loose[..., 2], 0.0, atol=1e-15)


def test_the_likelier_of_two_shapes_is_taken() -> None:
    S, columns = np.diag(np.full(2, 1e8)), np.zeros((1, 2))
    shapes = (np.diag([1.0, 1e-9]), np.diag([1e-9, 1.0]))
    effect = Effect(EffectName.LENS, 0, columns, shapes)
    found = size_of(effect, S, S @ np.array([0.0, 0.01]))
    assert found.covariance[1, 1] > 1e3 * found.covariance[0, 0]


def test_an_effect_within_its_uncertainty_is_not_certain() -> None:
    play = FoundEffect(EffectName.LOOSE, "", size=0.003, sigma=0.0014, gain=12.0)
    assert play.is_certain
    assert not replace(play, gain=10.0).is_certain
    assert not replace(play, size=0.001).is_certain
