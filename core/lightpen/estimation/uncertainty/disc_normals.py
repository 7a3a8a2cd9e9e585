"""The normal common to the discs, where it is not known exactly.

The centre of a disc's image lies off that of the disc by where it faces. The adjustment
holds the normals. What a turn of all of them adds to the uncertainty is found with it
as one more unknown of the same equations.
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
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.information import inverse
from lightpen.model.rigid import rotation_from_vector

TURN = 1e-3  # rad, of a difference


class NormalEffect(NamedTuple):
    """What an unknown turn of all normals comes to.

    Attributes
    ----------
    covariance : (p, p) array
        Of the unknowns of the bundle, beside that with the normals as they are.
    sigma : float
        Of the turn after the swing, rad.
    """

    covariance: FloatArray
    sigma: float


def effect_of_normals(bundle: Bundle, sigma: float) -> NormalEffect:
    """Return what an unknown turn of all normals adds to the uncertainty.

    Parameters
    ----------
    bundle : Bundle
        Of one camera.
    sigma : float
        Standard deviation of the turn before the swing, rad.
    """
    state, unknowns = bundle.state, bundle.unknowns
    view = views_at(state, np.zeros_like(bundle.residuals))[0]
    extended = with_normal(view, state)
    jitter = bundle.components.jitter.covariance
    each = eliminate((extended,), bundle.used, bundle.weight_sigma, jitter)
    own_end = N_CONE + view.own.shape[-1]
    K, p0 = unknowns.mixing.shape
    mixing = np.zeros((K + 2, p0 + 2))
    old_rows = np.r_[0:own_end, own_end + 2 : K + 2]
    mixing[np.ix_(old_rows, np.arange(p0))] = unknowns.mixing
    mixing[own_end, p0] = mixing[own_end + 1, p0 + 1] = 1.0
    between = unknowns.layout.between
    layout = unknowns.layout._replace(
        between=slice(between.start + 2, between.stop + 2)
    )
    information, _ = replace(unknowns, mixing=mixing, layout=layout).system(each)
    old = np.r_[0:p0, p0 + 2 : len(information)]
    known = bundle.prior_information + bundle.measured_information
    without = inverse(information[np.ix_(old, old)] + known)
    information[np.ix_(old, old)] += known
    information[[p0, p0 + 1], [p0, p0 + 1]] += sigma**-2
    both = inverse(information)
    left = float(np.sqrt(max(both[p0, p0], both[p0 + 1, p0 + 1])))
    return NormalEffect(both[np.ix_(old, old)] - without, left)


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
    """Return normals (L, 3) turned about two axes at right angles to their mean.

    Parameters
    ----------
    turn : (2,) array
        rad.
    """
    axes = across_normals(normals)
    return np.asarray(normals @ rotation_from_vector((turn @ axes)[None])[0].T)


def across_normals(normals: FloatArray) -> FloatArray:
    """Return two axes, (2, 3), at right angles to the mean of normals."""
    return np.asarray(np.linalg.svd(normals.mean(axis=0)[None])[2][1:])
