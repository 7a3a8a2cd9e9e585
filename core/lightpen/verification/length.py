"""A certified length between two cones, or of a bar, at several places.

An error of the pen's scale leaves no residual and moves nothing that stands still; a
length shows it. So the lengths, with all that is known of them, tell the scale anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits
from lightpen.sentences import sentence
from lightpen.verification.assessment import (
    CHECK_FILES,
    VERIFY_AGAIN,
    Conformity,
    accepted,
    check,
    refused,
)
from lightpen.verification.touch import NO_DRIFT, Touch, on_surface

Ends: TypeAlias = tuple[tuple[Touch, ...], tuple[Touch, ...]]

MIN_APART = 0.1  # of the certified length, between two ends
MAX_WIDE = 0.1  # of the distance of the ends, that touches of one end may scatter


@dataclass(frozen=True, eq=False)
class LengthRun:
    """A length measured at one place.

    Attributes
    ----------
    ends : pair of tuples of Touch
    measured : float
        mm.
    uncertainty : float
        U (k = 2) of it, mm.
    along_view : float
        Cosine between the length and the line of sight, 0 to 1: 1 measures depth.
    """

    name: str
    ends: Ends
    measured: float
    uncertainty: float
    along_view: float


@dataclass(frozen=True)
class Scale:
    """By how much the coordinates of the pen file are to be multiplied.

    Attributes
    ----------
    factor : float
    uncertainty : float
        U (k = 2) of it.
    uncertainty_before : float
        U (k = 2) without the length.
    """

    factor: float
    uncertainty: float
    uncertainty_before: float


@dataclass(frozen=True, eq=False)
class Length:
    """A certified length measured at one or several places.

    Attributes
    ----------
    certified, certified_uncertainty : float
        The length and U (k = 2) of it, mm.
    uncertainties : (N,) array
        U (k = 2) of each error, mm.
    """

    runs: tuple[LengthRun, ...]
    certified: float
    certified_uncertainty: float
    uncertainties: FloatArray
    scale: Scale
    assessment: Conformity

    @property
    def errors(self) -> FloatArray:
        """Measured less certified, of each place, mm."""
        return np.array([run.measured for run in self.runs]) - self.certified


def measure_length(
    runs: Sequence[tuple[str, Sequence[Touch]]],
    instrument: Instrument,
    certified: float,
    limits: VerificationLimits,
    *,
    certified_uncertainty: float = 0.0,
    ball_offset: float = 0.0,
    drift: FloatArray = NO_DRIFT,
) -> Length:
    """Measure a length at one or several places.

    Parameters
    ----------
    runs : sequence of (str, sequence of Touch)
        Name and touches of each place: both ends, each once or more.
    certified, certified_uncertainty : float
        The length and U (k = 2) of it, mm.
    ball_offset : float
        By which each end lies farther out than the centre of the ball that touched it,
        mm: its radius between inner faces, less than 0 on outer ones, 0 in cones.
    drift : (3,) array
        Standard uncertainty of a point by a camera that moved meanwhile, mm.

    Raises
    ------
    CalibrationError
        The touches of a place are not of two ends.
    """
    measured, rows, noises = [], [], []
    for name, touches in runs:
        ends = _on_faces(_two_ends(name, touches, certified), ball_offset)
        middles = [np.mean([t.point_cam for t in end], axis=0) for end in ends]
        span = middles[1] - middles[0]
        length = float(np.linalg.norm(span))
        along = span / length
        row, noise = np.zeros(len(instrument.covariance)), float(along**2 @ drift**2)
        for end, sign in zip(ends, (-1.0, 1.0), strict=True):
            for touch in end:
                row += sign / len(end) * along @ touch.sensitivity
                noise += float(along @ touch.noise @ along) / len(end) ** 2
        variance = float(row @ instrument.covariance @ row) + noise
        view = (middles[0] + middles[1]) / np.linalg.norm(middles[0] + middles[1])
        measured.append(
            LengthRun(
                name=name,
                ends=ends,
                measured=length,
                uncertainty=COVERAGE_FACTOR * float(np.sqrt(variance)),
                along_view=float(abs(along @ view)),
            )
        )
        rows.append(row)
        noises.append(noise)
    uncertainties = np.hypot(
        [run.uncertainty for run in measured], certified_uncertainty
    )
    errors = np.array([run.measured for run in measured]) - certified
    return Length(
        runs=tuple(measured),
        certified=certified,
        certified_uncertainty=certified_uncertainty,
        uncertainties=uncertainties,
        scale=_scale(
            instrument,
            np.array(rows),
            np.diag(noises) + (certified_uncertainty / COVERAGE_FACTOR) ** 2,
            errors,
        ),
        assessment=_assessment(measured, errors, uncertainties, limits),
    )


def _two_ends(name: str, touches: Sequence[Touch], certified: float) -> Ends:
    """Part the touches by the widest gap along the line that they lie on."""
    if len(touches) < 2:
        raise CalibrationError(
            sentence(
                "length.too-few",
                "{run} has {n_touches} touches that can be used; a length needs both "
                "its ends. Touch each end once at least.",
                run=name,
                n_touches=len(touches),
            )
        )
    points = np.array([touch.point_cam for touch in touches])
    along = np.linalg.svd(points - points.mean(axis=0))[2][0]
    places = points @ along
    order = np.argsort(places)
    widest = int(np.argmax(np.diff(places[order])))
    gap = float(np.diff(places[order])[widest])
    if gap < MIN_APART * certified:
        raise CalibrationError(
            sentence(
                "length.one-end",
                "All touches of {run} lie within {extent:.3f} mm: one end was touched "
                "again and the other not at all. Touch both ends.",
                run=name,
                extent=float(np.ptp(places)),
            )
        )
    ends = order[: widest + 1], order[widest + 1 :]
    widths = [
        np.linalg.norm(points[end] - points[end].mean(axis=0), axis=1) for end in ends
    ]
    for end, width in zip(ends, widths, strict=True):
        if width.max() > MAX_WIDE * gap:
            raise CalibrationError(
                sentence(
                    "length.no-end",
                    "The touches of {run} lie at more than two places: {touch} is "
                    "{distance:.2f} mm from the others of its end. Was the pen lifted "
                    "there? Touch nothing but the two ends.",
                    run=name,
                    touch=touches[int(end[np.argmax(width)])].label,
                    distance=float(width.max()),
                )
            )
    first, second = (tuple(touches[int(i)] for i in sorted(end)) for end in ends)
    return first, second


def _on_faces(ends: Ends, ball_offset: float) -> Ends:
    """Return both ends moved from the centres of the ball to what it touched."""
    one, other = (np.mean([t.point_cam for t in end], axis=0) for end in ends)
    outwards = (other - one) / np.linalg.norm(other - one)
    first, second = ends
    return (
        tuple(on_surface(touch, ball_offset, -outwards) for touch in first),
        tuple(on_surface(touch, ball_offset, outwards) for touch in second),
    )


def _scale(
    instrument: Instrument, rows: FloatArray, noise: FloatArray, errors: FloatArray
) -> Scale:
    """Return the scale by what was known and the lengths together (least squares)."""
    leds = instrument.pen.leds - instrument.pen.leds.mean(axis=0)
    of_scale = np.zeros(len(instrument.covariance))
    of_scale[instrument.parameters.leds] = (leds / np.sum(leds**2)).ravel()
    covariance = instrument.covariance
    spread = rows @ covariance @ rows.T + noise
    gain = np.linalg.solve(spread, rows @ covariance @ of_scale)
    before = float(of_scale @ covariance @ of_scale)
    after = before - float(gain @ rows @ covariance @ of_scale)
    return Scale(
        factor=1.0 - float(gain @ errors),
        uncertainty=COVERAGE_FACTOR * float(np.sqrt(max(after, 0.0))),
        uncertainty_before=COVERAGE_FACTOR * float(np.sqrt(before)),
    )


def _assessment(
    runs: Sequence[LengthRun],
    errors: FloatArray,
    uncertainties: FloatArray,
    limits: VerificationLimits,
) -> Conformity:
    worst = int(np.argmax(np.abs(errors)))
    error, uncertainty = float(errors[worst]), float(uncertainties[worst])
    if abs(error) > limits.length:
        return refused(
            sentence(
                "length.off",
                "The length at {run} is off by {error:+.4f} mm (U {uncertainty:.4f} "
                "mm, limit {limit:.4f} mm). Is it the certified length of this bar? "
                "Else the scale of the LED file or the camera file is wrong, or the "
                "pen is warmer than when it was measured.",
                run=runs[worst].name,
                error=error,
                uncertainty=uncertainty,
                limit=limits.length,
            ),
            CHECK_FILES,
        )
    if uncertainty > limits.length:
        return check(
            sentence(
                "length.uncertain",
                "U (k = 2) of the length at {run} is {uncertainty:.4f} mm, more than "
                "the limit of {limit:.4f} mm: this does not prove the tip. Touch each "
                "end more often, and lay the length across the view.",
                run=runs[worst].name,
                uncertainty=uncertainty,
                limit=limits.length,
            ),
            VERIFY_AGAIN,
        )
    return accepted(
        sentence(
            "length.good",
            "The length is off by {error:+.4f} mm at most (U {uncertainty:.4f} mm, "
            "limit {limit:.4f} mm).",
            error=error,
            uncertainty=uncertainty,
            limit=limits.length,
        )
    )
