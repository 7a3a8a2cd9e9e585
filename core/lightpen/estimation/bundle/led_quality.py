"""Residuals of each LED, and its displacement from the file."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.estimation.contact.joint import ContactModel, JointFit
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig

DISPLACED = 0.03  # mm; smaller errors are taken up by the fit
STANDS_OUT = 5.0  # times the median displacement of all LEDs
SIGNIFICANT = 5.0  # standard deviations
MIN_SEEN = 6  # images, to speak of a displacement


@dataclass(frozen=True, eq=False)
class LedQuality:
    """Quality of the fit of each LED."""

    # `n_seen` and `n_used`: (L,), images in which the LED was seen, and was used.
    n_seen: IntArray
    n_used: IntArray
    # (L,), root mean square residual of the images that use the LED, px; NaN if none.
    rms: FloatArray
    mean: FloatArray  # (L, 2), mean residual of these, px; NaN if none
    displacement: FloatArray  # (L, 3), fitted less stated position, pen frame, mm
    displaced: tuple[int, ...]  # numbers of the displaced LEDs, from 1


def measure_leds(rig: Rig, pen: Pen, pixels: FloatArray, joint: JointFit) -> LedQuality:
    """Measure how each LED fits, in the images of all cameras together.

    Parameters
    ----------
    rig : Rig
        Rig of the joint fit.
    pen : Pen
        Pen as in its file.
    pixels : (N, C, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    """
    seen = np.isfinite(pixels[..., 0]).reshape(-1, pen.n_leds)
    used = joint.used.reshape(seen.shape)
    n_used = used.sum(axis=0)
    counted = np.where(used, 1.0, 0.0) / np.maximum(n_used, 1)
    residuals = np.nan_to_num(joint.residuals).reshape(*seen.shape, 2)
    squares = np.einsum("nli,nli->nl", residuals, residuals)
    mean = np.einsum("nl,nli->li", counted, residuals)
    rms = np.sqrt(np.sum(counted * squares, axis=0))
    none = n_used == 0
    displacement, sigma = _displacements(rig, pen, pixels, joint)
    length = np.linalg.norm(displacement, axis=1)
    limit = np.maximum(STANDS_OUT * np.nanmedian(length), DISPLACED)
    displaced = np.flatnonzero((length > limit) & (length > SIGNIFICANT * sigma)) + 1
    return LedQuality(
        n_seen=seen.sum(axis=0),
        n_used=n_used,
        rms=np.where(none, np.nan, rms),
        mean=np.where(none[:, None], np.nan, mean),
        displacement=displacement,
        displaced=tuple(displaced.tolist()),
    )


def _displacements(
    rig: Rig, pen: Pen, pixels: FloatArray, joint: JointFit
) -> tuple[FloatArray, FloatArray]:
    """Return the position of each LED by the poses of all, and its std. deviation, mm.

    An LED that was mostly left out is judged by all its images; its scatter then says
    whether it is displaced or only badly seen.
    """
    model = ContactModel(rig, pen, pixels)
    state = model.at(joint.rotations, joint.tip_pen, joint.cone_cam)
    seen = np.isfinite(pixels[..., 0]).reshape(-1, pen.n_leds)
    used = joint.used.reshape(seen.shape)
    residuals = state.residuals.reshape(*seen.shape, 2)
    by_led = state.jacobian[..., 3:] @ joint.rotations[:, None]
    by_led = by_led.reshape(*seen.shape, 2, 3)
    displacement = np.full((pen.n_leds, 3), np.nan)
    sigma = np.full(pen.n_leds, np.nan)
    for j in range(pen.n_leds):
        trusted = used[:, j]
        chosen = trusted if 2 * trusted.sum() >= seen[:, j].sum() else seen[:, j]
        if chosen.sum() < MIN_SEEN:
            continue
        A = by_led[chosen, j].reshape(-1, 3)
        b = residuals[chosen, j].ravel()
        displacement[j] = np.linalg.lstsq(A, b)[0]
        scatter = float(np.std(b - A @ displacement[j]))
        sigma[j] = scatter * np.sqrt(np.trace(np.linalg.inv(A.T @ A)))
    return displacement, sigma
