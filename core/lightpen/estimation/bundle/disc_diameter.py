"""Diameter of the LED discs from the areas of their images.

Each whole LED of each image gives a diameter by equation (11) of method.md; focal
length and distance cancel. Errors are common to all images: the edge is cut at a level,
and blur, glare and an uneven face move that level. So the uncertainty is a share of the
edge width and the scatter of the LEDs, whatever the number of images.

A face that is brighter in its middle, as a dome is, shifts the centre where the edge is
blurred, the more the pen leans, as if the LEDs stood elsewhere along their normals.
LEDs that all face one way do not show that. Any face from an even one to a dome is
taken as equally likely.
"""

from dataclasses import dataclass
from math import hypot

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.ellipse import disc_images
from lightpen.model.quantiles import normal_quantile

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
