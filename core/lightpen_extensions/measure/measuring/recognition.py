"""Recognition of features: the simplest kind that the points lie on.

Kinds are tried in the order point, line, circle, plane, sphere, cylinder, cone; each
needs more points than determine it, except a single point. A kind is recognised if
the points lie within a form error that parts usually have, or within their noise.
"""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen_extensions.measure.measuring.features import Feature, fit_feature
from lightpen_extensions.measure.measuring.surfaces import NAMES, SURFACES, FeatureKind

SIMPLEST_FIRST = (
    FeatureKind.LINE,
    FeatureKind.CIRCLE,
    FeatureKind.PLANE,
    FeatureKind.SPHERE,
    FeatureKind.CYLINDER,
    FeatureKind.CONE,
)
FORM = 0.05  # mm, off a feature that is of its kind
DEVIATIONS = 4.0  # of the noise, likewise
LARGEST = 20.0  # times the extent of the points: a larger radius is a plane's
FACING = 0.7  # cosine of approach and normal, from which a face was touched
SURE = 5  # points on a circle that are not on a plane by chance
FLATTEST, SHARPEST = np.radians([80.0, 1.0])  # half angles of a cone


def recognise(
    points: FloatArray, noise: float, approaches: FloatArray | None = None
) -> FeatureKind | None:
    """Return the kind of feature that points lie on; None if they do not show it.

    The ball centres (N, 3), mm, have a noise, mm, that they do not share. Approaches
    (N, 3) are unit vectors along which the ball came; NaN if unknown.
    """
    if len(points) == 1:
        return FeatureKind.POINT
    limit = max(FORM, DEVIATIONS * noise)
    for kind in SIMPLEST_FIRST:
        fit = _redundant_fit(kind, points)
        if fit is None:
            continue
        off = float(np.linalg.norm(fit.distances, axis=1).max())
        if off <= limit and _is_plausible(fit, points, limit, approaches):
            return kind
    return None


def recognised(name: str, kind: FeatureKind | None) -> FeatureKind:
    """Return a recognised kind, or raise `CalibrationError` if there is none."""
    if kind is None:
        kinds = ", ".join(str(NAMES[each]) for each in FeatureKind)
        raise CalibrationError("measuring.not-recognised", name=name, kinds=kinds)
    return kind


def _redundant_fit(kind: FeatureKind, points: FloatArray) -> Feature | None:
    surface = SURFACES[kind]
    if len(points) <= surface.min_points:
        return None
    try:
        return fit_feature(kind, points)
    except CalibrationError:
        return None


def _is_plausible(
    fit: Feature, points: FloatArray, limit: float, approaches: FloatArray | None
) -> bool:
    extent = float(np.ptp(points, axis=0).max())
    if fit.kind is FeatureKind.CIRCLE:
        known = np.zeros(0) if approaches is None else np.abs(approaches @ fit.axis)
        known = known[np.isfinite(known)]
        is_face = known.size and float(np.median(known)) > FACING
        if is_face or (not known.size and len(points) < SURE):
            return False
    if fit.kind is FeatureKind.CONE:
        return bool(SHARPEST < fit.sizes[1] < FLATTEST)
    if not len(fit.sizes):
        return True
    radius = float(fit.sizes[0])
    is_bent = extent**2 / (8 * radius) > limit  # the sagitta shows
    return is_bent and radius < LARGEST * extent
