"""Progress of a swing: missing images, and the next posture."""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.pen_detection import PenDetection
from lightpen.messages import Message, message
from lightpen.model.coverage import N_DIRECTIONS
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.posture import (
    Posture,
    angles_between,
    posture_of,
    rotations_of,
    turns_of,
)
from lightpen.swing.capture.guidance import GuidanceInput, next_posture, visible_fields
from lightpen.swing.capture.seat import Seat
from lightpen.swing.capture.state import SwingSetup, SwingState
from lightpen.swing_messages import UNKNOWN, Code, too_little_tilt

UPRIGHT_HELD = 0.5  # s
LEARNING_TILT = np.radians(12.0)  # shows to which side the operator leans
REACHED = np.radians(5.0)  # of a target
N_MORE = 40  # images at least, where more are requested than a swing needs
PATIENCE = 4.0  # s until a target is chosen anew, reached or not
DECAY = 1 / 2  # U^2 less its floor goes with n^-DECAY, measured with simulated stations
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
