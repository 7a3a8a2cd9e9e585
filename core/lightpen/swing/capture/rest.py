"""Check that the tip rests in the cone, by the images of the last second."""

from collections.abc import Sequence

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.pivot.pivot import outlier_distance
from lightpen.model.coverage import MIN_SPREAD, posture_spread
from lightpen.model.pen import Pen
from lightpen.swing.capture.kept_images import distance_unit
from lightpen.swing.capture.seat import Seat, fit_seat, tip_distances, tip_offsets
from lightpen.swing.capture.state import RecentDetection, SwingState

BATCH = 1.0  # s, of images in which the tip must rest
FULL = 0.8  # of a batch, that its images must span
MIN_BATCH = 6  # images
STEADY = 3.0  # median distance of the tip, standard deviations; 1.5 is usual
MIN_KEPT = 3  # images for a better noise estimate than the last ones give


def seat_of(state: SwingState) -> Seat | None:
    """Return the best estimate of tip and cone."""
    return state.kept.seat or state.seat


def steady_seat(pen: Pen, state: SwingState) -> Seat | None:
    """Return the resting place of the tip in the last second; None if it moved.

    With a nominal tip the pen may stand still. Without one it must swing a little, or
    any still pen would do.
    """
    recent = state.recent
    if len(recent) < MIN_BATCH or state.time - recent[0].time < FULL * BATCH:
        return None
    rotations, translations = _poses(recent)
    if pen.nominal_tip is None and posture_spread(rotations)[0][1] < MIN_SPREAD:
        return None
    covariances = _covariances(state, recent)
    seat = fit_seat(pen, rotations, translations, covariances)
    distances = tip_distances(seat, rotations, translations, covariances)
    return seat if np.median(distances) < STEADY else None


def in_place(state: SwingState, recent: Sequence[RecentDetection]) -> BoolArray:
    """Return in which detections the tip is in the cone, (N,)."""
    seat = seat_of(state)
    if seat is None or not recent:
        return np.zeros(len(recent), dtype=bool)
    rotations, translations = _poses(recent)
    covariances = _covariances(state, recent)
    distances = tip_distances(seat, rotations, translations, covariances)
    return np.asarray(distances <= outlier_distance() * distance_unit(state.kept))


def rests_in_place(state: SwingState, seconds: float) -> bool:
    """Return whether the tip was in the cone for this time."""
    recent = [each for each in state.recent if each.time >= state.time - seconds]
    if not recent or recent[-1].time - recent[0].time <= FULL * seconds:
        return False
    return bool(np.mean(in_place(state, recent)) > FULL)


def offset(state: SwingState, seconds: float = 0.0) -> float:
    """Return the median distance of the tip from the cone over a time, mm."""
    seat = seat_of(state)
    recent = [each for each in state.recent if each.time >= state.time - seconds]
    if seat is None or not recent:
        return 0.0
    lengths = np.linalg.norm(tip_offsets(seat, *_poses(recent)), axis=1)
    return float(np.median(lengths))


def _poses(recent: Sequence[RecentDetection]) -> tuple[FloatArray, FloatArray]:
    detections = [each.detection for each in recent]
    rotations = np.array([each.rotation for each in detections])
    return rotations, np.array([each.translation for each in detections])


def _covariances(state: SwingState, recent: Sequence[RecentDetection]) -> FloatArray:
    sigma = state.kept.sigma
    if state.n_kept < MIN_KEPT:
        sigma = float(np.median([g.detection.sigma for g in state.recent]))
    return np.array([each.detection.cofactors for each in recent]) * sigma**2
