"""The uncertainty that a growing swing has reached, and can reach with its files.

During a swing tip and cone are fitted with the files held as they are. What the files
leave open, seat and drift belong to the uncertainty all the same. It is found by the
rule of the verdict (`lightpen.estimation.uncertainty.shares_of`), from the bundle
adjustment linearised where the joint fit stands: its normal equations are kept, so that
an image more adds no more than its own. That successive images may hang together is
left to the verdict.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray
from lightpen.estimation.adjustment import held_to_files
from lightpen.estimation.bundle import Bundle, jitter_of
from lightpen.estimation.component_search import find_components
from lightpen.estimation.components import NO_COMPONENTS
from lightpen.estimation.information import inverse
from lightpen.estimation.joint import JointFit
from lightpen.estimation.linearised import (
    N_CONE,
    BundleState,
    NormalEquations,
    eliminate,
    views_at,
)
from lightpen.estimation.priors import Priors, priors_of
from lightpen.estimation.seat_forms import forms_of
from lightpen.estimation.uncertainty import (
    COVERAGE_FACTOR,
    IMAGES_SHRINK,
    POSTURES,
    Share,
    ShareName,
    shares_of,
)
from lightpen.estimation.unknowns import Unknowns
from lightpen.model.assumptions import Assumptions
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig

T = TypeVar("T", bound=np.generic)

SEAT_ROUNDS = 2  # in which the jitter of the seat is found beside other errors
GROWTH = 1.25  # of the number of images, after which all are counted anew
ENDLESS = 100.0  # times the images, more than anyone takes


@dataclass(frozen=True)
class Reached:
    """How certain a tip is, and can become.

    Attributes
    ----------
    uncertainty : float
        U (k = 2) along the weakest direction, mm; infinite until it is known.
    floor : float
        What more images of this kind cannot bring it below, mm: what files, ball and
        cone leave open, and what does not average out.
    """

    uncertainty: float = float("inf")
    floor: float = 0.0


NOT_REACHED = Reached()


@dataclass(frozen=True, eq=False)
class Reach:
    """What the images of a swing say of all that they depend on.

    Attributes
    ----------
    state : BundleState
        About which the equations are, with the rotation of each image.
    equations : NormalEquations
        For a noise of 1 px.
    n_whole : int
        Images in it that were counted together, where one fit has them.
    """

    state: BundleState
    equations: NormalEquations
    n_whole: int

    def reached(self, joint: JointFit, sigma: float, assumed: Assumptions) -> Reached:
        """Return how certain the tip is by these images, and can become.

        Parameters
        ----------
        joint : JointFit
            The fit to them.
        sigma : float
            Noise of one image coordinate, px.
        """
        state = self.state
        priors = priors_of(state.rig, state.pen, assumed)
        unknowns = Unknowns.of(state, priors, forms_of(state.rotations))
        equations = _weighed(self.equations, sigma)
        bundle = _linear_bundle(unknowns, equations, joint, sigma)
        held_back = _kept_back(bundle, priors, equations)
        n_images = int(joint.used.any(axis=1).sum())
        noise = bundle.independent_noise
        now = shares_of(bundle, priors, n_images, noise, held_back)
        endless = _with_endless_images(bundle)
        nothing = np.zeros((6, 6))
        at_last = shares_of(endless, priors, n_images, nothing, nothing[0])
        stays = [each for each in at_last if each.name not in IMAGES_SHRINK]
        share = min(n_images / POSTURES, 1.0)  # of what no longer averages out then
        stays += [
            replace(each, covariance=share * each.covariance)
            for each in now
            if each.name is ShareName.CENTERS
        ]
        return Reached(_weakest(now), _weakest(stays))


def reach_of(
    rig: Rig,
    pen: Pen,
    pixels: FloatArray,
    joint: JointFit,
    before: Reach | None = None,
) -> Reach:
    """Return what images say, with that of all but the last ones where it is known.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        Of each camera, px; NaN where an LED was not seen.
    joint : JointFit
        The fit to them.
    before : Reach or None
        Of the first of these images.
    """
    n_images = len(pixels)
    state = BundleState(rig, pen, joint.tip_pen, joint.cone_cam, joint.rotations)
    if before is None or n_images > GROWTH * before.n_whole:
        return Reach(state, _counted(state, pixels, joint, 0), n_images)
    n_before = len(before.state.rotations)
    fresh = _counted(state, pixels, joint, n_before)
    return Reach(
        replace(before.state, rotations=joint.rotations),
        _joined(before.equations, _moved(fresh, state, before.state)),
        before.n_whole,
    )


def _counted(
    state: BundleState, pixels: FloatArray, joint: JointFit, first: int
) -> NormalEquations:
    state = replace(state, rotations=state.rotations[first:])
    n_cameras = state.rig.n_cameras
    views = views_at(state, pixels[first:])
    return eliminate(views, _by_camera(joint.used[first:], n_cameras), 1.0)


def _by_camera(values: npt.NDArray[T], n_cameras: int) -> npt.NDArray[T]:
    """Return what is of C cameras' LEDs one after the other, (N, C L, ...), apart."""
    return values.reshape(len(values), n_cameras, -1, *values.shape[2:])


def _moved(
    each: NormalEquations, now: BundleState, there: BundleState
) -> NormalEquations:
    """Return equations about the tip and the cone of another state."""
    step = np.zeros(len(each.b))
    step[:N_CONE] = now.cone_rig - there.cone_rig
    step[-3 * now.pen.n_leds :] = np.tile(there.tip_pen - now.tip_pen, now.pen.n_leds)
    return replace(
        each,
        b=each.b + each.N @ step,
        cone_right=each.cone_right + each.cone_rows @ step,
    )


def _joined(one: NormalEquations, other: NormalEquations) -> NormalEquations:
    return NormalEquations(
        one.N + other.N,
        one.b + other.b,
        np.concatenate([one.cone_rows, other.cone_rows]),
        np.concatenate([one.cone_right, other.cone_right]),
    )


def _weighed(each: NormalEquations, sigma: float) -> NormalEquations:
    """Return equations of a noise of 1 px for another, px."""
    weight = sigma**-2
    return NormalEquations(
        weight * each.N,
        weight * each.b,
        weight * each.cone_rows,
        weight * each.cone_right,
    )


def _linear_bundle(
    unknowns: Unknowns, equations: NormalEquations, joint: JointFit, sigma: float
) -> Bundle:
    """Return the bundle adjustment after a single step."""
    # LEDs that count by now may not have done so when they were counted.
    seen = np.trace(equations.cone_rows[..., :N_CONE], axis1=1, axis2=2) > 0
    spread = unknowns.sensitivity(equations.cone_rows)
    alone = information, right = unknowns.system(equations)
    components = NO_COMPONENTS
    for _ in range(SEAT_ROUNDS):
        # The jitter first: without it, what other errors there are take it up.
        covariance = inverse(information + unknowns.prior_information(components))
        change = covariance @ right
        jitter = jitter_of(unknowns, equations, spread, seen, change, covariance)
        information, right = (
            alone
            if jitter.covariance is None
            else unknowns.system(_with_jitter(equations, jitter.covariance))
        )
        components = components._replace(jitter=jitter)
        components = find_components(unknowns, information, right, components)
        if jitter.covariance is None:
            break
    prior = unknowns.prior_information(components)
    covariance = inverse(information + prior)
    n_cameras = unknowns.start.rig.n_cameras
    of_jitter = np.zeros_like(information)
    doubted = np.zeros_like(information)
    if jitter.covariance is None:
        rows = jitter.expected * spread.reshape(-1, spread.shape[-1])
        doubted = rows.T @ rows
    else:
        known = np.linalg.inv(jitter.covariance)
        seat = np.linalg.inv(equations.cone_rows[..., :N_CONE] + known) @ spread
        of_jitter = np.einsum("nip,ij,njq->pq", seat, known, seat, optimize=True)
    return Bundle(
        unknowns=unknowns,
        state=unknowns.start,
        values=covariance @ right,
        components=components,
        counted=components,
        residuals=_by_camera(joint.residuals, n_cameras),
        used=_by_camera(joint.used, n_cameras),
        sigma=sigma,
        information=information,
        prior_information=prior,
        measured_information=np.zeros_like(information),
        jitter_information=of_jitter,
        doubted_jitter=doubted,
        weight_sigma=sigma,
        covariance=covariance,
    )


def _with_jitter(each: NormalEquations, jitter: FloatArray) -> NormalEquations:
    """Return equations in which the seat may be another in each image.

    Parameters
    ----------
    jitter : (3, 3) array
        Covariance of the seat from image to image, mm^2.
    """
    gain = np.linalg.inv(each.cone_rows[..., :N_CONE] + np.linalg.inv(jitter))
    rows, right = each.cone_rows, each.cone_right
    left = np.eye(N_CONE) - rows[..., :N_CONE] @ gain
    by_seat = gain @ rows
    return NormalEquations(
        each.N - np.tensordot(rows, by_seat, axes=([0, 1], [0, 1])),
        each.b - np.einsum("nik,ni->k", by_seat, right),
        left @ rows,
        np.einsum("nij,nj->ni", left, right),
    )


def _kept_back(
    bundle: Bundle, priors: Priors, equations: NormalEquations
) -> FloatArray:
    """Return what keeping to assumed files as far as images allow changes, (6,), mm."""
    held = held_to_files(bundle, priors)
    if held is priors:
        return np.zeros(6)
    unknowns = replace(bundle.unknowns, priors=held)
    information, right = unknowns.system(equations)
    prior = unknowns.prior_information(bundle.components)
    return np.asarray((inverse(information + prior) @ right - bundle.values)[:6])


def _with_endless_images(bundle: Bundle) -> Bundle:
    """Return the adjustment with more images of the same kind than anyone takes."""
    information = ENDLESS * bundle.information
    nothing = np.zeros_like(information)
    prior = bundle.unknowns.prior_information(NO_COMPONENTS)
    return replace(
        bundle,
        components=NO_COMPONENTS,
        counted=NO_COMPONENTS,
        information=information,
        prior_information=prior,
        jitter_information=nothing,
        doubted_jitter=nothing,
        covariance=inverse(information + prior),
    )


def _weakest(shares: Sequence[Share]) -> float:
    """Return U (k = 2) of the tip along its weakest direction, mm."""
    covariance = sum((share.covariance[:3, :3] for share in shares), np.zeros((3, 3)))
    return COVERAGE_FACTOR * sqrt(float(np.linalg.eigvalsh(covariance)[-1]))
