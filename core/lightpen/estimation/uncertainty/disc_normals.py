"""The common normal of the discs as an uncertain parameter.

The centre of a disc's image deviates from the image of its centre, depending on the
normal. The adjustment holds the normals fixed. The uncertainty by a common rotation of
them is found with this rotation as a further unknown of the same equations.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    BundleState,
    CameraView,
    eliminate,
    views_at,
)
from lightpen.model.coverage import inverse
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector

TURN = 1e-3  # rad, of a difference


class NormalEffect(NamedTuple):
    """Effect of a rotation of all normals on a bundle with fixed normals."""

    gain: FloatArray  # (p, 2), change of the unknowns per rad of rotation
    # (2, 2), of the images on the rotation, all else unknown, 1/rad^2.
    information: FloatArray

    def covariance(self, of_turn: FloatArray) -> FloatArray:
        """Return the covariance (p, p), from the turn's covariance (2, 2), rad^2."""
        return np.asarray(self.gain @ of_turn @ self.gain.T)


def effect_of_normals(bundle: Bundle) -> NormalEffect:
    """Return the first-order effect of a rotation of all normals, by one camera."""
    state, unknowns = bundle.state, bundle.unknowns
    there = np.zeros_like(bundle.residuals)
    view = views_at(state, there, unknowns.field_columns)[0]
    extended = with_normal(view, state).in_units_of(unknowns.noise[:, 0])
    jitter = bundle.components.jitter.covariance
    each = eliminate((extended,), bundle.used, bundle.weight_sigma, jitter)
    own_end = N_CONE + view.own.shape[-1]
    K, p0 = unknowns.mixing.shape
    mixing = np.zeros((K + 2, p0 + 2))
    old_rows = np.r_[0:own_end, own_end + 2 : K + 2]
    mixing[np.ix_(old_rows, np.arange(p0))] = unknowns.mixing
    mixing[own_end, p0] = mixing[own_end + 1, p0 + 1] = 1.0
    drift = unknowns.layout.drift
    layout = unknowns.layout._replace(drift=slice(drift.start + 2, drift.stop + 2))
    information, _ = replace(unknowns, mixing=mixing, layout=layout).system(each)
    old = np.r_[0:p0, p0 + 2 : len(information)]
    known = bundle.prior_information + bundle.measured_information
    turn = [p0, p0 + 1]
    coupling = information[np.ix_(old, turn)]
    gain = -inverse(information[np.ix_(old, old)] + known) @ coupling
    own = information[np.ix_(turn, turn)] + coupling.T @ gain
    return NormalEffect(gain, own)


def covariance_of_turn(pen: Pen) -> FloatArray | None:
    """Return what a pen states of the turn, (2, 2), rad^2; None if nothing."""
    if pen.normal_covariance is None:
        return None
    axes = across_normals(pen.normals)
    return np.asarray(axes @ pen.normal_covariance @ axes.T)


def with_normal(view: CameraView, state: BundleState) -> CameraView:
    """Return a view with two more columns of its own: turns of the normal, rad."""
    camera = state.rig.cameras[0]
    _, points, normals = state.leds_in(0)
    radius = state.pen.diameter / 2
    here = ellipse_centers(camera, points, normals, radius)
    columns = []
    for turn in TURN * np.eye(2):
        turned = turned_normals(state.pen.normals, turn)
        normals = turned @ np.swapaxes(state.rotations, 1, 2)
        there = ellipse_centers(camera, points, normals, radius)
        columns.append((there - here) / TURN)
    return replace(view, own=np.concatenate([view.own, np.stack(columns, -1)], axis=3))


def turned_normals(normals: FloatArray, turn: FloatArray) -> FloatArray:
    """Return normals (L, 3) turned about two axes across their mean, by (2,), rad."""
    axes = across_normals(normals)
    return np.asarray(normals @ rotation_from_vector((turn @ axes)[None])[0].T)


def across_normals(normals: FloatArray) -> FloatArray:
    """Return two axes, (2, 3), at right angles to the mean of normals."""
    return np.asarray(np.linalg.svd(normals.mean(axis=0)[None])[2][1:])
