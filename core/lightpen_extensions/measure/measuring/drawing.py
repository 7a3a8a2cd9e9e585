"""Measured features as lines in space, for the window."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.artefacts import Side
from lightpen_extensions.measure.measuring.characteristics import Measured
from lightpen_extensions.measure.measuring.compensation import Evidence, TouchedSurface
from lightpen_extensions.measure.measuring.features import AXIS, PLACE, Feature
from lightpen_extensions.measure.measuring.quantities import Quantity
from lightpen_extensions.measure.measuring.starts import frame_about
from lightpen_extensions.measure.measuring.surfaces import FeatureKind

N_ROUND = 73  # points of a closed circle
MARK = 1.0  # mm, half size of the cross of a point, and of an untouched feature
CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))


def outline_of(one: Measured) -> list[FloatArray]:
    """Return the lines (M, 3) of a feature, mm, in the frame of the camera."""
    values = one.surface.quantity.values
    origin, axis, sizes = values[PLACE], values[AXIS], values[6:]
    frame = frame_about(axis)
    reach = _reach(one)
    along = [-reach * axis, reach * axis]
    match one.kind:
        case FeatureKind.POINT:
            return [origin + np.outer([-MARK, MARK], each) for each in np.eye(3)]
        case FeatureKind.LINE:
            return [origin + np.array(along)]
        case FeatureKind.PLANE:
            return [origin + reach * np.array(CORNERS) @ frame[:, :2].T]
        case FeatureKind.CIRCLE:
            return [_ring(origin, frame, sizes[0])]
        case FeatureKind.SPHERE:
            turned = (np.roll(np.eye(3), k, axis=0) for k in range(3))
            return [_ring(origin, each, sizes[0]) for each in turned]
        case FeatureKind.CYLINDER:
            return [_ring(origin + each, frame, sizes[0]) for each in along]
        case FeatureKind.CONE:
            slope = np.tan(sizes[1])
            radii = (max(sizes[0] + sign * reach * slope, 0.0) for sign in (-1, 1))
            pairs = zip(along, radii, strict=True)
            return [_ring(origin + each, frame, radius) for each, radius in pairs]


def of_centres(fit: Feature, points: FloatArray) -> Measured:
    """Return the feature of ball centres (N, 3) without an uncertainty, to be drawn."""
    values = Quantity(fit.values, np.zeros((len(fit.values), 0)))
    centres = Quantity(points.ravel(), np.zeros((points.size, 0)))
    surface = TouchedSurface(fit.kind, values, Side.OUTSIDE, Evidence.NONE)
    return Measured(surface, values, fit, centres)


def _ring(center: FloatArray, frame: FloatArray, radius: float) -> FloatArray:
    turn = np.linspace(0, 2 * np.pi, N_ROUND)
    return np.asarray(
        center + radius * np.column_stack([np.cos(turn), np.sin(turn)]) @ frame[:, :2].T
    )


def _reach(one: Measured) -> float:
    """Return the half extent of the points, along an axis or in all directions."""
    if one.points is None:
        return MARK
    points = one.points.values.reshape(-1, 3)
    away = points - points.mean(axis=0)
    if one.kind is not FeatureKind.PLANE:
        away = away @ one.surface.quantity.values[AXIS, None]
    return float(np.linalg.norm(away, axis=1).max())
