"""The unknown normal of the discs.

The centre of a disc's image lies off that of the disc by where it faces. The start
finds the normal common to all discs; the adjustment holds it. What that adds to the
uncertainty is found with the normal as one more unknown of the same equations.
"""

from dataclasses import replace

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
from lightpen.estimation.uncertainty.instrument import instrument_mixing
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.information import inverse
from lightpen.model.rigid import rotation_from_vector

TURN = 1e-3  # rad, of a difference
TINY = 1e-12
FACING = 0.3  # rad: standard deviation of the normal about the mean line of sight


def covariance_by_normal(bundle: Bundle) -> FloatArray:
    """Return what the parameters of an `Instrument` are uncertain by more, (q, q).

    Parameters
    ----------
    bundle : Bundle
        Of one camera.
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
    information[[p0, p0 + 1], [p0, p0 + 1]] += FACING**-2
    more = inverse(information)[np.ix_(old, old)] - without
    by = instrument_mixing(bundle)
    return np.asarray(by @ more @ by.T)


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
    across = _across(normals)
    return np.asarray(normals @ rotation_from_vector((turn @ across)[None])[0].T)


def towards_camera(state: BundleState) -> FloatArray:
    """Return the mean direction from the tip to the camera in the pen's frame, (3,).

    A pen is held with its discs to the camera, so their normal is near.
    """
    towards = -np.einsum("nji,j->ni", state.rotations, state.cone_rig).mean(axis=0)
    return np.asarray(towards / np.linalg.norm(towards))


def off_sight(state: BundleState) -> FloatArray:
    """Return the turn of the normal that would bring it to the camera, (2,), rad."""
    normals = state.pen.normals
    axis = np.cross(normals.mean(axis=0), towards_camera(state))
    sine = float(np.linalg.norm(axis))
    cosine = float(normals.mean(axis=0) @ towards_camera(state))
    turn = axis * np.arctan2(sine, cosine) / max(sine, TINY)
    return np.asarray(_across(normals) @ turn)


def _across(normals: FloatArray) -> FloatArray:
    """Return two axes, (2, 3), at right angles to the mean of normals."""
    return np.asarray(np.linalg.svd(normals.mean(axis=0)[None])[2][1:])
