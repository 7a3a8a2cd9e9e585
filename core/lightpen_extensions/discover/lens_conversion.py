"""Conversion of a camera to the nearest camera of another lens model."""

from dataclasses import replace

import numpy as np

from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera, lens_model_of

SHARES = (0.95, 0.7, 0.4)  # of the image, round its middle, the first that both image
SIDE = 15  # samples
STEPS = 12
WIDEST = np.tan(np.radians(75.0))  # of a polynomial in the normalised plane


def convert_lens(camera: Camera, n_coefficients: int) -> Camera | None:
    """Return the camera with another number of distortion coefficients.

    Gauss-Newton steps on the pixels of directions over the image; None where no such
    camera images them.
    """
    blank = replace(
        camera,
        distortion=np.zeros(n_coefficients),
        lens=lens_model_of(n_coefficients),
        covariance=None,
        lens_field=None,
    )
    for share in SHARES:
        try:
            found = _fitted(camera, blank, share)
        except (CalibrationError, np.linalg.LinAlgError):
            continue
        if found is not None:
            return found
    return None


def _fitted(camera: Camera, blank: Camera, share: float) -> Camera | None:
    steps = 0.5 + 0.5 * share * np.linspace(-1, 1, SIDE)
    size = np.array(camera.image_size) - 1.0
    pixels = (np.stack(np.meshgrid(steps, steps), axis=-1) * size).reshape(-1, 2)
    directions = camera.unproject(pixels[camera.sees(pixels)])
    directions = directions[np.linalg.norm(directions, axis=1) < WIDEST]
    if len(directions) < len(blank.intrinsics):
        return None
    wanted = camera.pixels(directions)
    found = blank
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            left = (wanted - found.pixels(directions)).reshape(-1)
            J = found.intrinsics_jacobian(directions).reshape(len(left), -1)
            scale = np.linalg.norm(J, axis=0)
            step = np.linalg.lstsq(J / scale, left, rcond=1e-9)[0] / scale
            found = found.with_intrinsics(found.intrinsics + step)
        left = wanted - found.pixels(directions)
    is_near = np.isfinite(left).all() and np.abs(left).max() < 0.02 * max(size)
    return found if is_near and found.fx > 0 and found.fy > 0 else None
