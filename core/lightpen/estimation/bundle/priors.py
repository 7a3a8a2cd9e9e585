"""Priors of cameras and pen: the uncertainties that files state, or assumed ones.

Where a file states no uncertainty, a documented assumption takes its place, which every
report marks as such.
"""

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.camera import Camera, LensModel
from lightpen.model.coverage import normal_quantile
from lightpen.model.ellipse import disc_images
from lightpen.model.limits import Assumptions
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig

# Diameter of the LED discs from the areas of their images.
#
# Each whole LED of each image gives a diameter by equation (11) of method.md; focal
# length and distance cancel. Errors are common to all images: the edge is cut at a
# level, and blur, glare and an uneven face move that level. So the uncertainty is a
# share of the edge width and the scatter of the LEDs, whatever the number of images.
#
# A face that is brighter in its middle, as a dome is, shifts the centre where the edge
# is blurred, the more the pen leans, as if the LEDs stood elsewhere along their
# normals. LEDs that all face one way do not show that. Any face from an even one to a
# dome is taken as equally likely.


# Rendered even, domed and ringed LEDs, hot spots and halos are off by 0.02 at most, a
# steep dome by 0.05, a blur of a fifth of the disc by 0.08.
EDGE_ERROR = 0.05  # systematic displacement of all edges, of the edge width
# Rendered domes stood 0.17 D (w - 1.35) / d^2 behind their discs, within a tenth, with
# discs of 5 and 10 mm (D), 21 and 43 px (d), and edges (w) of 2.4 px to a fifth of the
# disc; even faces, rings and hot spots a quarter of that at most.
DOME_SHIFT = 0.17
SHARP_EDGE = 1.35  # px wide
# Rendered domes of 2, 3 and 5 mm, 6 to 13 px wide, stood 0.034 to 0.051 D behind them.
SMALL_DOME_DEPTH = 0.05
MIN_READINGS = 20


@dataclass(frozen=True)
class DiameterReading:
    """Disc diameter by the areas of the images."""

    value: float  # mm
    sigma: float  # its standard uncertainty, mm
    # Standard uncertainty of a shift of all LEDs along normals by uneven faces, mm.
    shift: float


def modelled_areas(state: BundleState, c: int) -> FloatArray:
    """Return the areas of the discs' images in a camera of the rig, (N, L), px^2."""
    _, leds, normals = state.leds_in(c)
    images = disc_images(state.rig.cameras[c], leds, normals, state.pen.diameter / 2)
    return np.asarray(4 * np.pi * np.sqrt(np.linalg.det(images.shapes)))


def read_diameter(
    state: BundleState, areas: FloatArray, edge_widths: FloatArray
) -> DiameterReading | None:
    """Return the diameter of the discs by their images; None with too few areas.

    Parameters
    ----------
    state : BundleState
        State with the pose in each image.
    areas : (N, C, L) array
        Areas of the imaged discs, px^2; NaN where not known.
    edge_widths : (N, C) array
        Mean edge width of the LEDs in each image, px; NaN where not known.
    """
    rig, pen = state.rig, state.pen
    modelled = np.stack([modelled_areas(state, c) for c in range(rig.n_cameras)], 1)
    known = np.isfinite(areas) & np.isfinite(edge_widths)[..., None]
    if known.sum() < MIN_READINGS:
        return None
    diameters = pen.diameter * np.sqrt(areas[known] / modelled[known])
    value = float(np.median(diameters))
    scatter = float(np.median(np.abs(diameters - value))) / normal_quantile(0.25)
    widths = np.broadcast_to(edge_widths[..., None], areas.shape)[known]
    radii = np.sqrt(areas[known] / np.pi)
    edge = float(np.median(widths / radii))
    dome = float(np.median(np.maximum(widths - SHARP_EDGE, 0.0) / (2 * radii) ** 2))
    return DiameterReading(
        value,
        hypot(EDGE_ERROR * edge * value, scatter),
        DOME_SHIFT * dome * value / np.sqrt(3.0),  # of a rectangular distribution
    )


REFERENCE_TEMPERATURE = 20.0  # degrees C, at which lengths are stated: ISO 1


@dataclass(frozen=True, eq=False)
class Prior:
    """Prior of some unknowns."""

    covariance: FloatArray  # (k, k), of their deviation from what the file says
    assumed: bool  # whether the file states none
    # (k, k), of what it may be off beyond this covariance; None if it cannot.
    beyond: FloatArray | None = None

    @property
    def sigma(self) -> float:
        """Standard uncertainty of a single unknown."""
        return sqrt(float(self.covariance[0, 0]))


@dataclass(frozen=True, eq=False)
class Priors:
    """Priors of all unknowns but tip, cone and rotations."""

    cameras: tuple[Prior, ...]  # intrinsics of each camera
    # All cameras but the first, as in `Rig.covariance`; None for a single camera.
    extrinsics: Prior | None
    scale: Prior  # relative scale of all LED coordinates, from the LED measurement
    temperature: Prior  # scale by temperature
    diameter: Prior  # of the discs, mm
    led_sigma: float | None  # of an LED coordinate, mm; None: estimated from images
    form_error: float  # standard deviation of the seat along each axis in each mode, mm
    # Standard deviation of errors of a centre that repeat with the posture, px
    center_bias: float
    growth: float = 0.0  # thermal growth of the pen against its file, relative
    # (3 L, 3 L), of all LED coordinates, mm^2; None: only ``led_sigma`` is known.
    led_covariance: FloatArray | None = None
    reading: DiameterReading | None = None  # disc diameter from the image areas

    @property
    def size_covariance(self) -> FloatArray:
        """Return the covariance of the scale during the swing, (1, 1)."""
        return self.scale.covariance + self.temperature.covariance


def priors_of(rig: Rig, pen: Pen, assumptions: Assumptions) -> Priors:
    """Return the priors that files state, completed by assumptions."""
    extrinsics = None
    if rig.n_cameras > 1:
        extrinsics = (
            _assumed_extrinsics(rig, assumptions)
            if rig.covariance is None
            else Prior(rig.covariance, assumed=False)
        )
    return Priors(
        cameras=tuple(prior_of_camera(camera, assumptions) for camera in rig.cameras),
        extrinsics=extrinsics,
        scale=_stated_or(assumptions.scale, pen.scale_sigma),
        temperature=temperature_prior(pen, assumptions),
        diameter=_stated_or(assumptions.diameter * pen.diameter, pen.diameter_sigma),
        led_sigma=pen.led_sigma,
        form_error=assumptions.form_error,
        center_bias=assumptions.center_bias,
        growth=thermal_growth(pen, assumptions),
        led_covariance=pen.led_covariance,
    )


def prior_of_camera(camera: Camera, assumptions: Assumptions) -> Prior:
    """Return the prior of intrinsics that a file states, or an assumed one.

    What is correlated with the lens field is left to it, and so counted once.
    """
    field = camera.lens_field
    if field is not None and field.intrinsics_covariance is not None:
        return Prior(field.intrinsics_covariance, assumed=False)
    if camera.covariance is not None:
        return Prior(camera.covariance, assumed=False)
    variances = np.zeros(len(camera.intrinsics))
    variances[2:4] = assumptions.principal_point**2
    variances[4:6] = assumptions.k1**2, assumptions.k2**2
    if camera.lens is LensModel.BROWN:
        variances[6:8] = assumptions.tangential**2
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


def thermal_growth(pen: Pen, assumptions: Assumptions) -> float:
    """Return the thermal expansion of a pen against its file, relative, equation (10).

    0 where its temperature was not measured, or the file states no expansion.
    """
    if pen.expansion is None:
        return 0.0
    return pen.expansion * _warmth(pen, assumptions)


def _warmth(pen: Pen, assumptions: Assumptions) -> float:
    """Return the temperature difference of the pen from its measurement, K."""
    if assumptions.temperature_c is None:
        return 0.0
    measured = pen.temperature_c
    return assumptions.temperature_c - (
        REFERENCE_TEMPERATURE if measured is None else measured
    )


def temperature_prior(pen: Pen, assumptions: Assumptions) -> Prior:
    """Return the prior of the thermal expansion, relative, equation (10)."""
    is_measured = assumptions.temperature_c is not None
    warmth = _warmth(pen, assumptions)
    uncertainty = assumptions.temperature if is_measured else assumptions.warmth
    if pen.expansion is None:  # nothing is corrected then
        expansion = sigma = assumptions.expansion
    else:
        expansion = pen.expansion
        sigma = (
            assumptions.expansion_share * abs(expansion)
            if pen.expansion_sigma is None
            else pen.expansion_sigma
        )
    return _one(
        hypot(expansion * uncertainty, sigma * warmth),
        assumed=pen.expansion is None or not is_measured,
    )


def _stated_or(assumed: float, stated: float | None) -> Prior:
    return _one(assumed if stated is None else stated, assumed=stated is None)


def _one(sigma: float, *, assumed: bool) -> Prior:
    return Prior(np.array([[sigma**2]]), assumed)
