"""Calibrations by simulated swings, each with something that a plain swing has not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from tests.simulated_centers import (
    observe_pixels,
    simulate_centers,
    simulate_rig_centers,
)
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations
from lightpen.detection.rig_observations import observe_rig_centers
from lightpen.estimation.bundle.unknowns import led_basis
from lightpen.estimation.calibrate import Calibration, calibrate, calibrate_rig
from lightpen.formats.observation_files import Centers, pair_images
from lightpen.model.camera import Camera
from lightpen.model.ellipse import disc_images
from lightpen.model.fisheye import LensField
from lightpen.model.pen import Pen, effective_tip, grown
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import (
    PAPER_TIP,
    Postures,
    Swing,
    leds_in_camera,
    paper_camera,
    paper_pen,
    seen_from,
    swing_from_postures,
    swing_poses,
)

CAMERA = paper_camera()
PEN = replace(paper_pen(), led_sigma=0.002)
N_IMAGES = 40


def swing_of(seed: int, n_images: int = N_IMAGES) -> Swing:
    return swing_poses(n_images, np.random.default_rng(seed))


def lasting(seed: int, correlation: float, n_images: int = N_IMAGES) -> FloatArray:
    """Return noise of unit variance that lasts from image to image."""
    fresh = np.random.default_rng(seed).standard_normal((n_images, PEN.n_leds, 2))
    noise = fresh.copy()
    for i in range(1, n_images):
        noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * fresh[i]
    return noise


def observed(
    swing: Swing, errors: FloatArray, camera: Camera = CAMERA, pen: Pen = PEN
) -> Observations:
    exact = simulate_centers(
        *(CAMERA, PEN, swing.rotations, swing.translations),
        *(0.0, np.random.default_rng(0)),
    )
    return observe_pixels(exact + errors, camera, pen)


def disc_areas(swing: Swing, diameter: float, rng: np.random.Generator) -> FloatArray:
    """Return areas of discs, (N, L), px^2, with noise of 0.2 percent."""
    leds, normals = leds_in_camera(PEN, swing.rotations, swing.translations)
    shapes = disc_images(CAMERA, leds, normals, diameter / 2).shapes
    areas = 4 * np.pi * np.sqrt(np.linalg.det(shapes))
    return np.asarray(areas * (1 + 0.002 * rng.standard_normal(areas.shape)))


def usual() -> Calibration:
    """Images that slipped, do not fit, or lack LEDs are left out."""
    swing, errors = swing_of(1), 0.03 * lasting(1, 0.0)
    translations = swing.translations.copy()
    translations[5:8] += [0.5, 0.0, 0.2]
    errors[11] += np.linspace(-2, 2, PEN.n_leds)[:, None]
    errors[20, 2:] = np.nan
    errors[25:, 3] = np.nan
    moved = replace(swing, translations=translations)
    return calibrate(CAMERA, PEN, observed(moved, errors))


def restless_swing() -> Swing:
    rng = np.random.default_rng(2)
    swing = swing_of(2, 60)
    moves = 0.008 * rng.standard_normal((60, 3))
    moves += np.linspace(0, 0.06, 60)[:, None] * [1.0, 0.0, 0.5]
    turns = 2 * np.arctan2(swing.rotations[:, 0, 1], swing.rotations[:, 2, 1])
    moves[:, 0] += 0.02 * np.cos(turns)
    return replace(swing, translations=swing.translations + moves)


def restless() -> Calibration:
    """Noise that lasts, a seat that jitters and wanders, and a slow drift."""
    errors = 0.05 * lasting(2, 0.8, 60)
    return calibrate(CAMERA, PEN, observed(restless_swing(), errors))


def spoilt_files() -> Calibration:
    """A camera and a pen file that are off by more than they state, and one LED."""
    wrong = replace(
        CAMERA, fx=1.004 * CAMERA.fx, fy=1.004 * CAMERA.fy, cx=CAMERA.cx + 4
    )
    leds = grown(PEN, 3e-4, PAPER_TIP).leds.copy()
    leds[2] += [0.05, -0.08, 0.0]
    pen = replace(PEN, leds=leds)
    return calibrate(
        wrong, pen, observed(swing_of(4), 0.03 * lasting(4, 0.0), wrong, pen)
    )


def followed() -> Calibration:
    """A camera that moves, with lamps that tell, and discs whose areas are measured."""
    swing, rng = swing_of(5), np.random.default_rng(5)
    way = np.outer(np.sin(np.linspace(0, 4, N_IMAGES)), [1.5, 0.8])
    lamps = np.array([[1100.0, 900.0], [1300.0, 1100.0]]) + way[:, None]
    lamps += 0.02 * rng.standard_normal(lamps.shape)
    seen = observed(swing, way[:, None] + 0.03 * lasting(5, 0.0))
    areas = disc_areas(swing, 1.002 * PEN.diameter, rng)
    seen = replace(seen, lamps=lamps, areas=areas, edge_widths=np.full(N_IMAGES, 2.2))
    return calibrate(CAMERA, PEN, seen)


def larger_discs() -> Calibration:
    """Larger discs than the file has, that may be turned, and a stated lens field."""
    swing, rng = swing_of(9, 25), np.random.default_rng(9)
    field = LensField.of(CAMERA.width, CAMERA.height, 0.05, 300.0)
    waves = 0.1 * np.sin(field.nodes / 260.0)
    field = replace(field, values=waves, covariance=0.1 * field.covariance)
    camera = replace(CAMERA, lens_field=field)
    seen = observed(swing, 0.03 * lasting(9, 0.7, 25), camera)
    areas = disc_areas(swing, 1.02 * PEN.diameter, rng)
    seen = replace(seen, areas=areas, edge_widths=np.full(25, 2.2))
    turns = np.diag([0.1, 0.2, 0.3]) ** 2
    pen = replace(PEN, diameter_sigma=0.002, normal_covariance=turns)
    return calibrate(camera, pen, seen)


def by_two_cameras() -> Calibration:
    """The second camera stands a little elsewhere than the file has it."""
    row = row_of_cameras(2, 1000.0)
    rig, places = from_first(row), (row.rotations[0], row.translations[0])
    swing, rng = seen_from(swing_of(7, 25), *places), np.random.default_rng(7)
    pixels = simulate_rig_centers(rig, PEN, swing, 0.03, rng)
    pixels[3, 1], pixels[9, 0, 2:], pixels[14, 1, :4] = np.nan, np.nan, np.nan
    turned = rotation_from_vector(np.array([2e-4, -3e-4, 1e-4]))
    rotations = np.stack([rig.rotations[0], turned @ rig.rotations[1]])
    filed = replace(rig, rotations=rotations)
    centers = [
        Centers(taken, pixels[taken, c], Path("simulated"))
        for c in range(2)
        for taken in [np.flatnonzero(np.isfinite(pixels[:, c]).any(axis=(1, 2)))]
    ]
    pairing = pair_images([list(map(str, c.frames)) for c in centers], rig.names)
    return calibrate_rig(filed, PEN, observe_rig_centers(centers, pairing, filed, PEN))


def steadily(times: FloatArray) -> Swing:
    """Return a swing round the cone, at times in image intervals."""
    phase = 2 * np.pi * times / N_IMAGES
    tilts = np.radians(22 + 7 * np.sin(0.37 * phase))
    return swing_from_postures(Postures(tilts, phase, 0.4 * np.sin(0.71 * phase)))


def by_a_late_camera() -> Calibration:
    """Its file is off and states nothing, nor does the rig's; an LED is noisy."""
    row, rng = row_of_cameras(2, 1000.0), np.random.default_rng(12)
    rig, places = from_first(row), (row.rotations[0], row.translations[0])
    moments = np.arange(28.0)
    pixels = np.stack(
        [
            simulate_rig_centers(rig, PEN, seen_from(swing, *places), 0.0, rng)[:, c]
            for c, swing in enumerate((steadily(moments), steadily(moments + 0.03)))
        ],
        axis=1,
    )
    sigmas = 0.03 * np.exp(0.5 * rng.standard_normal(pixels.shape[:-1]))
    noise = sigmas[..., None] * rng.standard_normal(pixels.shape)
    noise[:, 0, 4] *= 5
    pixels += noise
    pixels[7, 1], pixels[21, 0] = np.nan, np.nan
    centers = [
        Centers(taken, pixels[taken, c], Path("simulated"))
        for c in range(2)
        for taken in [np.flatnonzero(np.isfinite(pixels[:, c]).any(axis=(1, 2)))]
    ]
    off = rig.cameras[1].with_intrinsics(
        rig.cameras[1].intrinsics * ([1.001] * 2 + 7 * [1])
    )
    filed = replace(
        rig, cameras=(rig.cameras[0], replace(off, covariance=None)), covariance=None
    )
    pairing = pair_images([list(map(str, c.frames)) for c in centers], rig.names)
    seen = observe_rig_centers(centers, pairing, filed, PEN)
    weighed = [
        replace(each, sigmas=np.where(np.isfinite(each.sigmas), sigmas[:, c], np.nan))
        for c, each in enumerate(seen)
    ]
    return calibrate_rig(filed, PEN, weighed)


def loose_swing() -> Swing:
    swing = swing_of(11, 30)
    across = swing.rotations[:, :, 1] - swing.rotations[:, :, 1].mean(axis=0)
    across[:, 1] = 0.0
    angle = np.arctan2(across[:, 2], across[:, 0])
    moves = 0.03 * across / np.linalg.norm(across, axis=1, keepdims=True)
    moves[:, 0] += 0.03 * (np.cos(angle) + np.cos(3 * angle))
    moves[:, 2] += 0.03 * (np.sin(3 * angle) - np.sin(angle))
    return replace(swing, translations=swing.translations + moves)


def loose() -> Calibration:
    """A stylus that jumps to the side of the lean, in an oval seat.

    The LED file has a covariance, and one of the normals.
    """
    basis = led_basis(PEN.leds)
    pen = replace(
        PEN,
        led_sigma=None,
        led_covariance=0.002**2 * basis @ basis.T,
        normal_covariance=0.01**2 * np.eye(3),
    )
    errors = 0.02 * lasting(11, 0.0, 30)
    return calibrate(CAMERA, pen, observed(loose_swing(), errors, CAMERA, pen))


def uneven() -> Calibration:
    """LEDs that differ in noise, on a stylus that bends."""
    swing, rng = steadily(np.arange(N_IMAGES, dtype=float)), np.random.default_rng(8)
    axes = swing.rotations[:, :, 1]
    bent = swing.translations + 0.06 * (axes - axes.mean(axis=0))
    pixels = simulate_centers(CAMERA, PEN, swing.rotations, bent, 0.0, rng)
    sigmas = 0.03 * np.exp(0.5 * rng.standard_normal(pixels.shape[:2]))
    sigmas[:, 3] *= 5
    pixels += sigmas[..., None] * rng.standard_normal(pixels.shape)
    sigmas[:, 3] /= 5
    seen = observe_pixels(pixels, CAMERA, PEN)
    return calibrate(CAMERA, PEN, replace(seen, sigmas=sigmas))


def oval_swing() -> Swing:
    swing = swing_of(11)
    right, away = swing.rotations[:, 0, 1], swing.rotations[:, 2, 1]
    angle = np.arctan2(away, right)
    sides = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    moves = 0.01 * np.cos(2 * angle - 0.7)[:, None] * sides
    return replace(swing, translations=swing.translations + moves)


def oval_seat() -> Calibration:
    """A seat 10 um out of round."""
    return calibrate(CAMERA, PEN, observed(oval_swing(), 0.03 * lasting(11, 0.0)))


SWINGS: dict[str, Callable[[], Calibration]] = {
    each.__name__: each
    for each in (
        *(usual, restless, spoilt_files, followed, uneven, larger_discs, loose),
        *(oval_seat, by_two_cameras, by_a_late_camera),
    )
}
_MOVED = {"restless": restless_swing, "loose": loose_swing, "oval_seat": oval_swing}


def true_tip(name: str) -> FloatArray:
    """Return the effective tip of one of these swings, (3,), mm."""
    if name not in _MOVED:
        return PAPER_TIP
    swing = _MOVED[name]()
    return effective_tip(swing.rotations, swing.translations)[:3]
