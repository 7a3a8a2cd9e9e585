"""What is known of camera and pen before a swing, each with its uncertainty.

What a file states of its own uncertainty is taken as stated. What it leaves out is not
zero: a documented assumption takes its place and is told wherever the result is.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.assumptions import Assumptions
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of some unknowns before the images.

    Attributes
    ----------
    covariance : (k, k) array
        Of their deviation from what the file says.
    assumed : bool
        Whether it stands in for what the file leaves out.
    """

    covariance: FloatArray
    assumed: bool


@dataclass(frozen=True, eq=False)
class Priors:
    """What is known of all that a fit holds beside tip, cone and rotations.

    Attributes
    ----------
    cameras : tuple of Prior
        Of the intrinsics of each camera.
    extrinsics : Prior or None
        Of all cameras but the first, as `Rig.covariance`; None of a single camera.
    scale : Prior
        Of the pen: relative, of all its coordinates.
    diameter : Prior
        Of the discs, mm.
    led_sigma : float or None
        Of one LED coordinate, mm; None: to be found from the images.
    led_covariance : (3 L, 3 L) array or None
        Of all of them, mm^2, where more is known than ``led_sigma``.
    """

    cameras: tuple[Prior, ...]
    extrinsics: Prior | None
    scale: Prior
    diameter: Prior
    led_sigma: float | None
    led_covariance: FloatArray | None = None


def priors_of(rig: Rig, pen: Pen, assumptions: Assumptions) -> Priors:
    """Return what the files of rig and pen state, completed by assumptions."""
    extrinsics = None
    if rig.n_cameras > 1:
        extrinsics = (
            _assumed_extrinsics(rig, assumptions)
            if rig.covariance is None
            else Prior(rig.covariance, assumed=False)
        )
    return Priors(
        cameras=tuple(_intrinsics(camera, assumptions) for camera in rig.cameras),
        extrinsics=extrinsics,
        scale=_scale(pen, assumptions),
        diameter=(
            _one(assumptions.diameter * pen.diameter, assumed=True)
            if pen.diameter_sigma is None
            else _one(pen.diameter_sigma, assumed=False)
        ),
        led_sigma=pen.led_sigma,
        led_covariance=pen.led_covariance,
    )


def _intrinsics(camera: Camera, assumptions: Assumptions) -> Prior:
    if camera.covariance is not None:
        return Prior(camera.covariance, assumed=False)
    variances = np.zeros(len(camera.intrinsics))
    variances[2:4] = assumptions.principal_point**2
    variances[4:9] = np.square(
        [
            assumptions.k1,
            assumptions.k2,
            assumptions.tangential,
            assumptions.tangential,
            0.0,
        ]
    )
    covariance = np.diag(variances)
    focal = np.array([camera.fx, camera.fy])
    # fx and fy share what the focal length is off by; their ratio is known far better.
    covariance[:2, :2] = np.outer(focal, focal) * assumptions.focal_length**2
    covariance[1, 1] += (camera.fy * assumptions.aspect) ** 2
    return Prior(covariance, assumed=True)


def _assumed_extrinsics(rig: Rig, assumptions: Assumptions) -> Prior:
    one = np.repeat([assumptions.rotation, assumptions.translation], 3)
    sigmas = np.tile(one, rig.n_cameras - 1)
    return Prior(np.diag(sigmas**2), assumed=True)


def _scale(pen: Pen, assumptions: Assumptions) -> Prior:
    """Return the prior of the scale: its measurement, and what warmth makes of it."""
    if pen.scale_sigma is not None:
        return _one(pen.scale_sigma, assumed=False)
    return _one(assumptions.scale, assumed=True)


def _one(sigma: float, *, assumed: bool) -> Prior:
    return Prior(np.array([[sigma**2]]), assumed)
