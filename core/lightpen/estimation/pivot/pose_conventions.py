"""Detection of other conventions of poses: frames, order of numbers, units.

Poses in another convention are valid rotations and translations and may even fit a tip
badly; only their scatter shows it. So each usual mistake is undone in turn; one that
brings the poses much closer to a common tip is reported.

Inverted poses are the exception. They fit as well, since ``R tip + t = pivot`` also
reads ``R^T pivot - R^T t = tip``: tip and pivot change places. Only a tip farther from
its pen than from the camera gives them away, which may be true: that is reported, not
refused.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import agreeing_solution, contact_residuals
from lightpen.messages import Message, message

Poses: TypeAlias = tuple[FloatArray, FloatArray]

MUCH_CLOSER = 0.6  # of the scatter as read
ROUNDING = 1e-6  # of the length of the translations: scatter of exact poses
AGREEING = 0.5  # of the poses, at least
FEW = 20  # poses; half of fewer would agree with anything
AGREEING_OF_FEW = 0.9
MAX_LOOKED_AT = 200  # poses examined; all have one convention
SHORT = 10.0  # mm; no tracked pen is that close to its tracker in most poses
LONG = 10_000.0  # mm; no pen is that long
MAX_SCATTER = 20.0  # mm; no tip rests so badly
USUAL_SCATTER = 5.0  # mm; more is no noise if the poses move by little more
MAX_SHARE = 0.4  # of the movement of the poses, that a tip leaves over


@dataclass(frozen=True)
class _PoseMistake:
    """A usual mistake: how it is undone, and its message."""

    undo: Callable[[FloatArray, FloatArray], Poses]
    remark: Callable[[float, float], Message]


def require_usual_reading(rotations: FloatArray, translations: FloatArray) -> None:
    """Raise `CalibrationError` if poses are not cam_from_pen, mm, or have no tip.

    It says what they look like, and what is needed.
    """
    typical = float(np.median(np.linalg.norm(translations, axis=1)))
    if typical < SHORT:
        raise CalibrationError("poses.in-metres", typical=typical)
    chosen = np.unique(
        np.linspace(0, len(rotations) - 1, MAX_LOOKED_AT).round().astype(int)
    )
    R, t = rotations[chosen], translations[chosen]
    as_read = _scatter(R, t)
    undone = [_scatter(*mistake.undo(R, t)) for mistake in _MISTAKES]
    likeliest = int(np.argmin(undone))
    closer = undone[likeliest] < MUCH_CLOSER * as_read
    if closer and as_read > ROUNDING * typical:
        raise CalibrationError(_MISTAKES[likeliest].remark(as_read, undone[likeliest]))
    _require_tip(R, t, as_read)


def is_likely_inverted(tip_pen: FloatArray, pivot_cam: FloatArray) -> bool:
    """Return whether a tip is farther from its pen than from the camera."""
    return bool(np.linalg.norm(tip_pen) > np.linalg.norm(pivot_cam))


def _require_tip(R: FloatArray, t: FloatArray, scatter: float) -> None:
    length = float(np.linalg.norm(_solution(R, t)[:3]))
    if length > LONG:
        raise CalibrationError("poses.in-micrometres", length=length / 1000)
    movement = float(np.median(np.linalg.norm(t - np.median(t, axis=0), axis=1)))
    unexplained = scatter > USUAL_SCATTER and scatter > MAX_SHARE * movement
    if scatter > MAX_SCATTER or unexplained:
        raise CalibrationError("poses.no-tip", scatter=scatter, movement=movement)


def _scatter(rotations: FloatArray, translations: FloatArray) -> float:
    """Return the median distance of the poses' tips from their pivot, mm."""
    solution = _solution(rotations, translations)
    residuals = contact_residuals(rotations, translations, solution[:3], solution[3:])
    return float(np.median(np.linalg.norm(residuals, axis=1)))


def _solution(rotations: FloatArray, translations: FloatArray) -> FloatArray:
    share = AGREEING_OF_FEW if len(rotations) <= FEW else AGREEING
    return agreeing_solution(rotations, translations, share)


def _transposed(rotations: FloatArray) -> FloatArray:
    return np.swapaxes(rotations, 1, 2)


def _with_scalar_moved(rotations: FloatArray, places: int) -> FloatArray:
    """Return rotations from quaternions with the scalar at the other end."""
    from scipy.spatial.transform import Rotation  # takes 0.2 s

    quaternions = Rotation.from_matrix(rotations).as_quat()
    return np.asarray(Rotation.from_quat(np.roll(quaternions, places, 1)).as_matrix())


def _flipped(axis: int) -> _PoseMistake:
    return _PoseMistake(
        lambda R, t: (R, t * np.where(np.arange(3) == axis, -1.0, 1.0)),
        lambda as_read, undone: message(
            "poses.flipped", axis="xyz"[axis], as_read=as_read, undone=undone
        ),
    )


def _quaternion_message(as_read: float, undone: float) -> Message:
    return message("poses.quaternion-order", as_read=as_read, undone=undone)


_MISTAKES = (
    _PoseMistake(
        lambda R, t: (_transposed(R), t),
        lambda as_read, undone: message(
            "poses.transposed", as_read=as_read, undone=undone
        ),
    ),
    _PoseMistake(lambda R, t: (_with_scalar_moved(R, 1), t), _quaternion_message),
    _PoseMistake(lambda R, t: (_with_scalar_moved(R, -1), t), _quaternion_message),
    *(_flipped(axis) for axis in range(3)),
)
