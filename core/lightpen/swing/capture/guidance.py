"""The next posture: the one that reduces the tip's uncertainty most.

What an image of a posture would say of tip and cone follows from the contact model
before it is taken [1]_. Images are taken on the way to a posture as well, so a posture
is judged by all the images that the pen would give until it is there: by how much they
would shrink the variance of the tip, per image.

References
----------
.. [1] A. C. Atkinson, A. N. Donev, "Optimum experimental designs" (1992), chapter 10.
.. [2] M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018).
"""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.pen_detection import PenDetection
from lightpen.estimation.contact.joint import ContactModel, reduce
from lightpen.messages import UNKNOWN, Code, Message, message, too_little_tilt
from lightpen.model.coverage import N_DIRECTIONS
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.rigid import (
    Posture,
    Rig,
    angles_between,
    posture_of,
    rotation_from_vector,
    rotations_of,
    turns_of,
    vector_from_rotation,
)
from lightpen.swing.capture.kept_images import Seat
from lightpen.swing.capture.state import SwingSetup, SwingState

TILTS = (np.radians(14.0), np.radians(28.0))  # in the middle of the rings of the dial
TURNS = (np.radians(-25.0), 0.0, np.radians(25.0))
WITHIN = np.radians([5.0, 18.0, 12.0])  # of a field, from its middle: tilt and turns
EVEN_STEPS = np.array([0.8191725, 0.6710436, 0.5497005])  # of a sequence in a cube [2]_
N_ON_THE_WAY = 3  # postures that represent all in between
MAX_INCIDENCE = np.radians(70.0)  # an LED seen flatter is a line, and dim
MIN_GAP = 4.0  # px between the edges of two LEDs; blur joins closer ones


@dataclass(frozen=True, eq=False)
class GuidanceInput:
    """Inputs for the choice of the next posture."""

    rig: Rig  # one of its cameras must see enough of the pen
    pen: Pen
    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    information: FloatArray  # (6, 6), all information on (tip, cone), 1/mm^2
    sigma: float  # noise of one image coordinate, px
    rotations: FloatArray  # (N, 3, 3), postures of the images kept so far; cam_from_pen
    spacing: float  # least angle between a new posture and these, rad


def next_posture(
    outlook: GuidanceInput,
    present: FloatArray,
    wanted: BoolArray | None = None,
    avoided: Posture | None = None,
) -> Posture | None:
    """Return the posture to lean the pen to from ``present``, cam_from_pen (3, 3).

    ``wanted`` (3, 8) are the fields of the dial to choose from, all unless given:
    upright (in the first column), leaning and leaning far, by direction from the right.
    ``avoided`` is not chosen.
    None if the LEDs could be seen in none of the postures. Where there are images on
    all ways to the middles of these fields, it is beside a middle.
    """
    best = None
    for beside in (np.zeros(3), _beside(len(outlook.rotations))):
        postures, rotations, fields = _candidates(outlook.pen, beside)
        fit = _is_seen(outlook, rotations)
        if wanted is not None:
            fit &= wanted[fields[:, 0], fields[:, 1]]
        fit &= [posture != avoided for posture in postures]
        chosen = np.flatnonzero(fit)
        if not len(chosen):
            continue
        worth = _worth(outlook, present, rotations[chosen])
        best = postures[int(chosen[np.argmax(worth)])]
        if worth.max() > 0:
            break
    return best


def visible_fields(outlook: GuidanceInput) -> BoolArray:
    """Return in which fields of the dial the pen shows enough LEDs, (3, 8)."""
    _, rotations, fields = _candidates(outlook.pen, np.zeros(3))
    row, column = fields[_is_seen(outlook, rotations)].T
    visible = np.zeros((3, N_DIRECTIONS), dtype=bool)
    visible[row, column] = True
    return visible


def image_information(outlook: GuidanceInput, rotations: FloatArray) -> FloatArray:
    """Predict the information (N, 6, 6), 1/mm^2, of images about (tip, cone).

    Their rotations (N, 3, 3) are cam_from_pen.
    """
    rig, pen = outlook.rig, outlook.pen
    none = np.zeros((len(rotations), rig.n_cameras, pen.n_leds, 2))
    model = ContactModel(rig, pen, none)
    state = model.at(rotations, outlook.tip_pen, outlook.cone_cam)
    seen = usable_leds(outlook, rotations).astype(float)
    return np.asarray(reduce(state, seen).S / outlook.sigma**2)


def usable_leds(outlook: GuidanceInput, rotations: FloatArray) -> BoolArray:
    """Return the mask of LEDs that are whole, separate and face the camera, (N, C L).

    The LEDs in one camera after those in the other.
    """
    rig = outlook.rig
    each = [_usable_leds(outlook, rotations, c) for c in range(rig.n_cameras)]
    return np.concatenate(each, axis=1)


def _usable_leds(outlook: GuidanceInput, rotations: FloatArray, c: int) -> BoolArray:
    """Return this mask for the c-th camera, (N, L)."""
    camera, pen = outlook.rig.cameras[c], outlook.pen
    R, t = outlook.rig.rotations[c], outlook.rig.translations[c]
    turned = np.swapaxes(R @ rotations, 1, 2)
    leds = (pen.leds - outlook.tip_pen) @ turned + R @ outlook.cone_cam + t
    cosines = -np.einsum("nli,nli->nl", leds, pen.normals @ turned)
    cosines /= np.linalg.norm(leds, axis=2)
    pixels = camera.project(leds)
    radii = max(camera.fx, camera.fy) * pen.diameter / 2 / leds[..., 2]
    size = np.array(camera.image_size)
    room = np.minimum(pixels + 0.5, size - 0.5 - pixels).min(axis=2)
    apart = np.linalg.norm(pixels[:, :, None] - pixels[:, None], axis=3)
    apart -= radii[:, :, None] + radii[:, None]
    apart += np.where(np.eye(pen.n_leds, dtype=bool), np.inf, 0)
    return np.asarray(
        (cosines > np.cos(MAX_INCIDENCE))
        & (leds[..., 2] > 0)
        & (room > radii)
        & (apart.min(axis=2) > MIN_GAP)
    )


def _beside(n: int) -> FloatArray:
    """Return the n-th of places spread evenly in a cube from -1 to 1, (3,) [2]_."""
    return 2 * ((0.5 + n * EVEN_STEPS) % 1) - 1


def _candidates(
    pen: Pen, beside: FloatArray
) -> tuple[list[Posture], FloatArray, IntArray]:
    """Return postures in the fields of the dial, rotations, and row and column.

    ``beside`` (3,) is how far they lie from the middles of the fields, from -1 to 1.
    """
    fields = [(0, 0)] + [(row, k) for row in (1, 2) for k in range(N_DIRECTIONS)]
    places = [(row, column, turn) for row, column in fields for turn in TURNS]
    up, right, about = beside * WITHIN
    postures = [
        Posture(
            abs((0.0, *TILTS)[row] + up),
            column * 2 * np.pi / N_DIRECTIONS + right,
            turn + about,
        )
        for row, column, turn in places
    ]
    numbers = np.array([(p.tilt, p.direction, p.turn) for p in postures])
    rotations = rotations_of(pen, numbers[:, 0], numbers[:, 1], numbers[:, 2])
    return postures, rotations, np.array([place[:2] for place in places])


def _is_seen(outlook: GuidanceInput, rotations: FloatArray) -> BoolArray:
    """Return in which postures a camera shows enough LEDs."""
    least = certain_leds(outlook.pen)
    each = [
        _usable_leds(outlook, rotations, c).sum(axis=1) >= least
        for c in range(outlook.rig.n_cameras)
    ]
    return np.asarray(np.any(each, axis=0))


def _worth(
    outlook: GuidanceInput, present: FloatArray, rotations: FloatArray
) -> FloatArray:
    """Return the expected reduction of the tip's variance on the way, mm^2.

    Per image; ``rotations`` (C, 3, 3) gives (C,).
    """
    vectors = vector_from_rotation(rotations @ present.T)
    shares = np.arange(1, N_ON_THE_WAY + 1) / N_ON_THE_WAY
    steps = rotation_from_vector(vectors[:, None] * shares[:, None]) @ present
    steps = steps.reshape(-1, 3, 3)
    new = np.ones(len(steps))
    if len(outlook.rotations):
        nearest = angles_between(steps, outlook.rotations).min(axis=1)
        new = (nearest >= outlook.spacing).astype(float)
    each = image_information(outlook, steps) * new[:, None, None]
    by_way = each.reshape(len(rotations), N_ON_THE_WAY, 6, 6).mean(axis=1)
    n_images = np.maximum(np.linalg.norm(vectors, axis=1) / outlook.spacing, 1.0)
    after = np.linalg.inv(outlook.information + n_images[:, None, None] * by_way)
    before = np.linalg.inv(outlook.information)
    gain = _tip_variance(np.asarray(before)) - _tip_variance(np.asarray(after))
    return np.asarray(gain / n_images)


def _tip_variance(covariances: FloatArray) -> FloatArray:
    """Return the variance of the tip, summed over x y z, mm^2."""
    tips: FloatArray = covariances[..., :3, :3]
    return np.asarray(np.trace(tips, axis1=-2, axis2=-1))


UPRIGHT_HELD = 0.5  # s
LEARNING_TILT = np.radians(12.0)  # shows to which side the operator leans
REACHED = np.radians(5.0)  # of a target
N_MORE = 40  # images at least, where more are requested than a swing needs
PATIENCE = 4.0  # s until a target is chosen anew, reached or not
DECAY = 2 / 3  # U^2 less its floor goes with n^-DECAY, measured with simulated stations
ENOUGH_FILLED = 0.5  # of the fields, before the lowest achievable U is reported


@dataclass(frozen=True, eq=False)
class Shortfall:
    """Images that a swing still needs."""

    wanted: IntArray  # (3, 8), in each field of the dial
    fields: IntArray  # (3, 8), missing ones of these
    n_images: int  # missing in all, at the least
    # That the uncertainty still needs, estimated; 0 if it suffices or no number does.
    n_for_uncertainty: int
    # That will still be taken, estimated: as many for each that a field lacks as it
    # took until now, and no more than the limit allows.
    n_more: int

    @property
    def is_none(self) -> bool:
        """Whether nothing is missing."""
        return self.n_images == 0 and self.n_for_uncertainty == 0


def measure_shortfall(setup: SwingSetup, state: SwingState) -> Shortfall:
    """Measure what postures and uncertainty still need.

    Fields of the dial in which the camera would not see enough LEDs are not requested.
    """
    limits = setup.limits
    wanted: IntArray = np.full((3, N_DIRECTIONS), limits.min_per_field, dtype=np.int64)
    wanted[0, 1:] = 0
    seat = state.kept.seat
    if seat is not None:
        wanted[~visible_fields(_outlook(setup, state, seat))] = 0
    fields = np.maximum(wanted - state.counts, 0)
    n_for_uncertainty = _n_for_uncertainty(state, limits)
    n_images = max(limits.min_images - state.n_kept, int(fields.sum()), 0)
    n_allowed = max(limits.max_images - state.n_kept, 0)
    n_filled = int(np.minimum(wanted, state.counts).sum())
    n_for_fields = ceil(int(fields.sum()) * max(state.n_kept / max(n_filled, 1), 1.0))
    n_more = min(max(n_images, n_for_fields, n_for_uncertainty), n_allowed)
    return Shortfall(wanted, fields, n_images, n_for_uncertainty, n_more)


def _n_for_uncertainty(state: SwingState, limits: SwingLimits) -> int:
    """Return the number of images to bring U to its limit; 0 if impossible."""
    limit, floor = limits.max_uncertainty, state.kept.predicted.floor
    if state.kept.uncertainty <= limit or floor >= limit:
        return 0
    # Noise goes with one over the number of images; what lens and camera may be is
    # known more slowly.
    ratio = (state.kept.uncertainty**2 - floor**2) / (limit**2 - floor**2)
    times = float(ratio) ** (1 / DECAY) - 1
    bounded: float = min(times * max(state.n_kept, 1), limits.max_images)
    return max(ceil(bounded), 1)


def limits_for_more(limits: SwingLimits, n_kept: int) -> SwingLimits:
    """Return limits by which a complete swing continues."""
    n_images = n_kept + N_MORE
    return replace(
        limits,
        min_images=max(limits.min_images, n_images),
        max_images=max(limits.max_images, n_images),
    )


def out_of_reach(
    limits: SwingLimits, state: SwingState, short: Shortfall
) -> Message | None:
    """Return why no number of images brings U to its limit, if none does.

    More images of the same kind do not lower the floor, but other postures do. So
    nothing is said before half of those that are wanted are there.
    """
    reached = state.kept.predicted
    is_early = short.fields.sum() > (1 - ENOUGH_FILLED) * short.wanted.sum()
    if is_early or reached.floor < limits.max_uncertainty:
        return None
    return message(
        Code.OUT_OF_REACH,
        floor=1000 * reached.floor,
        limit=1000 * limits.max_uncertainty,
    )


def turn_range(pen: Pen, rotations: FloatArray) -> tuple[float, float] | None:
    """Return the least and the greatest turn of a pen about its own axis, rad.

    None without any of the rotations cam_from_pen (N, 3, 3).
    """
    if not len(rotations):
        return None
    turns = turns_of(pen, rotations)
    return float(turns.min()), float(turns.max())


def missing(setup: SwingSetup, state: SwingState) -> tuple[Message, ...]:
    """Return messages on what an early finish would lack."""
    short = measure_shortfall(setup, state)
    found = []
    if short.fields[1:].any():
        directions = np.flatnonzero(short.fields[1:].sum(axis=0))
        n_images = int(short.fields[1:].sum())
        found.append(too_little_tilt(n_images, map(int, directions)))
    if short.fields[0, 0]:
        found.append(message(Code.NOT_UPRIGHT, n_images=int(short.fields[0, 0])))
    if short.n_for_uncertainty:
        uncertainty = state.kept.uncertainty
        limit = setup.limits.max_uncertainty
        known = np.isfinite(uncertainty)
        found.append(
            message(Code.UNCERTAIN, uncertainty=uncertainty, limit=limit)
            if known
            else UNKNOWN
        )
    never = out_of_reach(setup.limits, state, short)
    if never is not None:
        found.append(never)
    if state.n_kept < setup.limits.min_images:
        found.append(
            message(
                Code.TOO_FEW_IMAGES, n_kept=state.n_kept, needed=setup.limits.min_images
            )
        )
    return tuple(found)


def next_target(
    setup: SwingSetup,
    state: SwingState,
    present: FloatArray,
    avoided: Posture | None = None,
) -> Posture | None:
    """Return the next posture, from the present rotation (3, 3); not the avoided one.

    Once the uncertainty suffices, only fields that lack images are chosen from.
    """
    seat = state.kept.seat or state.seat
    if seat is None:
        return None
    outlook = _outlook(setup, state, seat)
    short = measure_shortfall(setup, state)
    if short.n_for_uncertainty == 0 and short.fields.any():
        return next_posture(outlook, present, short.fields > 0, avoided)
    return next_posture(outlook, present, avoided=avoided)


def oriented(
    setup: SwingSetup, state: SwingState, detection: PenDetection
) -> SwingState:
    """Set the heading of the operator by a tilt to the right of an upright pen.

    A pen that is tilted already says nothing: the tilt is requested once it is upright.
    """
    if state.heading is not None:
        return state
    if not state.was_upright:
        return replace(state, was_upright=is_upright(state))
    posture = posture_of(setup.pen, detection.rotation)
    if posture.tilt > LEARNING_TILT:
        eighth = 2 * np.pi / N_DIRECTIONS
        heading = float(round(posture.direction / eighth) % N_DIRECTIONS * eighth)
        state = replace(state, heading=heading)
    return state


def is_upright(state: SwingState) -> bool:
    """Return whether the pen was upright and still for a moment."""
    since = state.still_since
    return since is not None and state.time - since >= UPRIGHT_HELD


def guided(setup: SwingSetup, state: SwingState, detection: PenDetection) -> SwingState:
    """Choose a target if there is none, it is reached, or it stays out of reach."""
    if state.heading is None:
        return state
    target, avoided, away = state.target, None, True
    if target is not None:
        wanted = rotations_of(
            setup.pen,
            np.array([target.tilt]),
            np.array([target.direction]),
            np.array([target.turn]),
        )
        away = angles_between(wanted, detection.rotation[None])[0, 0] > REACHED
        is_recent = state.time - state.target_since < PATIENCE
        if away and is_recent:
            return state
        if not (away or is_recent):  # nothing new comes of it any more
            avoided = target
    chosen = next_target(setup, state, detection.rotation, avoided)
    since = state.target_since if chosen == target and not away else state.time
    return replace(state, target=chosen, target_since=since)


def _outlook(setup: SwingSetup, state: SwingState, seat: Seat) -> GuidanceInput:
    detection = state.detection
    sigma = state.kept.sigma
    if not state.n_kept and detection is not None:
        sigma = detection.sigma
    return GuidanceInput(
        rig=setup.rig,
        pen=setup.pen,
        tip_pen=seat.tip_pen,
        cone_cam=seat.cone_cam,
        information=np.asarray(np.linalg.inv(seat.covariance)),
        sigma=sigma,
        rotations=state.kept.rotations,
        spacing=setup.limits.spacing,
    )
