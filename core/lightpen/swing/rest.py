"""Whether the tip rests in the cone, by the images of the last second."""

from collections.abc import Sequence

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.pivot import GATE
from lightpen.model.coverage import MIN_SPREAD, posture_spread
from lightpen.model.pen import Pen
from lightpen.swing.kept_images import distance_unit
from lightpen.swing.seat import Seat, fit_seat, tip_distances, tip_offsets
from lightpen.swing.state import Glimpse, SwingState

BATCH = 1.0  # s, of images in which the tip must rest
FULL = 0.8  # of a batch, that its images must span
MIN_BATCH = 6  # images
STEADY = 3.0  # median distance of the tip, standard deviations; 1.5 is usual
MIN_KEPT = 3  # images whose noise is better known than that of the last ones


def seat_of(state: SwingState) -> Seat | None:
    """Return where the tip should be by the best that is known."""
    return state.kept.seat or state.seat


def steady_seat(pen: Pen, state: SwingState) -> Seat | None:
    """Return where the tip rested for the last second; None if it did not.

    With a nominal tip the pen may stand still. Without one it must swing a little, or
    any still pen would do.
    """
    glimpses = state.recent
    if len(glimpses) < MIN_BATCH or state.time - glimpses[0].time < FULL * BATCH:
        return None
    rotations, translations = _poses(glimpses)
    if pen.nominal_tip is None and posture_spread(rotations)[0][1] < MIN_SPREAD:
        return None
    covariances = _covariances(state, glimpses)
    seat = fit_seat(pen, rotations, translations, covariances)
    distances = tip_distances(seat, rotations, translations, covariances)
    return seat if np.median(distances) < STEADY else None


def in_place(state: SwingState, glimpses: Sequence[Glimpse]) -> BoolArray:
    """Return in which glimpses the tip is where it should be, (N,)."""
    seat = seat_of(state)
    if seat is None or not glimpses:
        return np.zeros(len(glimpses), dtype=bool)
    rotations, translations = _poses(glimpses)
    covariances = _covariances(state, glimpses)
    distances = tip_distances(seat, rotations, translations, covariances)
    return np.asarray(distances <= GATE * distance_unit(state.kept))


def rests_in_place(state: SwingState, seconds: float) -> bool:
    """Return whether the tip was where it should be for this time."""
    glimpses = [g for g in state.recent if g.time >= state.time - seconds]
    enough = len(glimpses) > 1 and glimpses[-1].time - glimpses[0].time > (
        FULL * seconds
    )
    return enough and bool(np.mean(in_place(state, glimpses)) > FULL)


def offset(state: SwingState, seconds: float = 0.0) -> float:
    """Return how far the tip was from where it should be, mm; the median of a time."""
    seat = seat_of(state)
    glimpses = [g for g in state.recent if g.time >= state.time - seconds]
    if seat is None or not glimpses:
        return 0.0
    lengths = np.linalg.norm(tip_offsets(seat, *_poses(glimpses)), axis=1)
    return float(np.median(lengths))


def _poses(glimpses: Sequence[Glimpse]) -> tuple[FloatArray, FloatArray]:
    return (
        np.array([g.sighting.rotation for g in glimpses]),
        np.array([g.sighting.translation for g in glimpses]),
    )


def _covariances(state: SwingState, glimpses: Sequence[Glimpse]) -> FloatArray:
    sigma = state.kept.sigma
    if state.n_kept < MIN_KEPT:
        sigma = float(np.median([g.sighting.sigma for g in state.recent]))
    return np.array([g.sighting.cofactors for g in glimpses]) * sigma**2
