"""Irradiance on the sensor by LEDs, lamps and other lights."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.faces import (
    LightArray,
    Patch,
    blurred_insides,
    disc_contours,
    ellipse_contour,
    face_patches,
)
from lightpen_extensions.simulator.swings import faces_camera, leds_in_camera
from lightpen_extensions.simulator.view import (
    BOARD_OFFSET,
    GHOST_OFFSET,
    Lamp,
    Optics,
    View,
    Window,
)

DEFOCUS_SAMPLES = 9  # per pixel and axis, of the defocus kernel
HALO_SIGMA = 15.0  # px
BOARD_SIGMA = 2.0  # px
HALO_REACH = 3.0  # standard deviations; zero beyond


@dataclass(frozen=True, eq=False)
class Light:
    """Light on the sensor, before noise."""

    levels: LightArray  # (H, W), light above the background, fraction of full scale
    windows: tuple[Window, ...]  # where levels are not zero; they may overlap
    background: float = 0.0  # fraction of full scale
    gradient: tuple[float, float] = (0.0, 0.0)  # of it, over width and height


def render_view(camera: Camera, pen: Pen, view: View, optics: Optics) -> Light:
    """Return the light of one exposure."""
    levels = np.zeros((camera.height, camera.width), dtype=np.float32)
    windows = _add_patches(levels, _led_patches(camera, pen, view, optics))
    for lamp in view.lamps:
        windows += _add_patches(levels, _lamp_patches(lamp, optics))
    for other in view.others:
        windows += other.draw(levels, optics.exposure)
    across, down = optics.gradient
    return Light(
        levels,
        tuple(windows),
        optics.exposure * optics.background,
        (optics.exposure * across, optics.exposure * down),
    )


def led_levels(
    leds_cam: FloatArray, normals_cam: FloatArray, optics: Optics
) -> FloatArray:
    """Return the level of every LED of gain 1, fraction of full scale, (..., L).

    Zero for those that face away.
    """
    ranges = np.linalg.norm(leds_cam, axis=-1)
    cosines = -np.einsum("...i,...i->...", leds_cam, normals_cam) / ranges
    peak = optics.peak * optics.exposure
    levels = peak * np.maximum(cosines, 0) ** optics.cos_power
    return np.where(faces_camera(leds_cam, normals_cam), levels, 0.0)


def _led_patches(camera: Camera, pen: Pen, view: View, optics: Optics) -> list[Patch]:
    leds, normals = leds_in_camera(pen, view.rotations, view.translations)
    levels = (view.gains * led_levels(leds, normals, optics)).min(axis=0)
    lit = np.flatnonzero(levels)
    if len(lit) == 0:
        return []
    margin = _margin(optics)
    if view.faces:
        patches = face_patches(
            camera,
            pen,
            view.rotations,
            view.translations,
            view.faces,
            lit.tolist(),
            optics.psf_sigma,
            margin,
        )
    else:
        contours = disc_contours(
            camera, leds[:, lit], normals[:, lit], pen.diameter / 2, optics.psf_sigma
        )
        patches = blurred_insides(contours, optics.psf_sigma, margin)
    return _scattered(_shining(patches, levels[lit], optics), optics)


def _lamp_patches(lamp: Lamp, optics: Optics) -> list[Patch]:
    contour = ellipse_contour(lamp.center, lamp.semi_axes, lamp.angle, optics.psf_sigma)
    patches = blurred_insides(contour, optics.psf_sigma, _margin(optics))
    return _shining(patches, np.array([lamp.level * optics.exposure]), optics)


def _margin(optics: Optics) -> int:
    """Return the reach of scattered light around a disc, px."""
    halo = HALO_REACH * HALO_SIGMA if optics.halo > 0 else 0.0
    ghost = max(GHOST_OFFSET) if optics.ghost > 0 else 0
    board = max(BOARD_OFFSET) + HALO_REACH * BOARD_SIGMA if optics.board > 0 else 0.0
    return int(np.ceil(optics.defocus_radius + max(halo, ghost, board)))


def _shining(patches: list[Patch], levels: FloatArray, optics: Optics) -> list[Patch]:
    """Return scaled and defocused patches."""
    radius = optics.defocus_radius
    for patch, level in zip(patches, levels, strict=True):
        patch.levels[:] *= np.float32(level)
        if radius > 0:
            kernel = _disc_kernel(radius)
            patch.levels[:] = cv2.filter2D(
                patch.levels, -1, kernel, borderType=cv2.BORDER_CONSTANT
            )
    return patches


def _scattered(patches: list[Patch], optics: Optics) -> list[Patch]:
    """Return patches with halo, ghost image and reflection."""
    if optics.halo == 0 and optics.ghost == 0 and optics.board == 0:
        return patches
    across, down = GHOST_OFFSET
    beside, below = BOARD_OFFSET
    for patch in patches:
        sharp = patch.levels.copy()
        patch.levels[:] *= np.float32(1 - optics.halo - optics.ghost - optics.board)
        if optics.halo > 0:
            patch.levels[:] += np.float32(optics.halo) * cv2.GaussianBlur(
                sharp, (0, 0), HALO_SIGMA, borderType=cv2.BORDER_CONSTANT
            )
        patch.levels[down:, across:] += (
            np.float32(optics.ghost) * sharp[:-down, :-across]
        )
        if optics.board > 0:
            reflected = cv2.GaussianBlur(
                sharp, (0, 0), BOARD_SIGMA, borderType=cv2.BORDER_CONSTANT
            )
            patch.levels[below:, beside:] += (
                np.float32(optics.board) * reflected[:-below, :-beside]
            )
    return patches


@lru_cache(maxsize=32)
def _disc_kernel(radius: float) -> LightArray:
    """Return a uniform disc; the weight of a pixel is its covered area."""
    half = int(np.ceil(radius))
    n_fine = (2 * half + 1) * DEFOCUS_SAMPLES
    fine = (np.arange(n_fine) + 0.5) / DEFOCUS_SAMPLES - half - 0.5
    inside = fine[:, None] ** 2 + fine**2 <= radius**2
    shape = (2 * half + 1, DEFOCUS_SAMPLES, 2 * half + 1, DEFOCUS_SAMPLES)
    covered = inside.reshape(shape).sum(axis=(1, 3))
    return np.asarray(covered / covered.sum(), dtype=np.float32)


def _add_patches(levels: LightArray, patches: list[Patch]) -> list[Window]:
    windows = []
    for patch in patches:
        top, left = patch.top, patch.left
        height, width = patch.levels.shape
        window = clipped(levels, Window(top, top + height, left, left + width))
        if window is not None:
            rows = slice(window.top - top, window.bottom - top)
            columns = slice(window.left - left, window.right - left)
            levels[window.slices] += patch.levels[rows, columns]
            windows.append(window)
    return windows


def clipped(levels: LightArray, window: Window) -> Window | None:
    """Return the part of a window that is within an image; None if it is outside."""
    height, width = levels.shape
    inside = Window(
        max(int(window.top), 0),
        min(int(window.bottom), height),
        max(int(window.left), 0),
        min(int(window.right), width),
    )
    empty = inside.top >= inside.bottom or inside.left >= inside.right
    return None if empty else inside
