"""Tip, pen and camera as found, with their joint covariance."""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.uncertainty.disc_normals import (
    across_normals,
    effect_of_normals,
)
from lightpen.estimation.uncertainty.instrument import Parameters, instrument_mixing
from lightpen.estimation.uncertainty.second_cone import SecondSwing
from lightpen.model.camera import Camera
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.information import inverse
from lightpen.model.pen import Pen, moved, order_of_paper
from lightpen.model.self_calibration import FoundCamera, FoundPen, marks_of
from lightpen_extensions.boards.distortion import Choice
from lightpen_extensions.discover.hypotheses import Hypothesis
from lightpen_extensions.discover.normals import FACING
from lightpen_extensions.discover.numbering import frame_by, framed
from lightpen_extensions.discover.scale import with_led_covariance, with_lengths_known
from lightpen_extensions.discover.starts import KnownLength, farthest_apart


@dataclass(frozen=True, eq=False)
class Discovery:
    """Tip, pen and camera that a swing showed."""

    pen: Pen  # in its frame, with the covariance of its LEDs
    camera: Camera  # with its covariance
    tip_pen: FloatArray  # (3,), mm
    # (q, q), of tip, camera, diameter and LEDs, as `parameters` has them, in the frame
    # in which the LEDs fit the true ones best
    covariance: FloatArray
    # (3, 3), share of the lens in the covariance of the tip, mm^2
    beyond_fit: FloatArray
    calibration: Calibration  # the final adjustment
    lengths: tuple[KnownLength, ...]
    is_relative: bool  # whether there was no length
    hypotheses: tuple[Hypothesis, ...]
    n_lamps: int  # lights that did not move with the pen
    lens_choice: Choice | None = None  # None if the camera is known

    @property
    def parameters(self) -> Parameters:
        """Indices of each kind of parameter in the covariance."""
        return self.calibration.instrument.parameters

    @property
    def has_free_frame(self) -> bool:
        """Whether the frame can be chosen: the LEDs lack the layout of the paper."""
        up = self.pen.leds.mean(axis=0) - self.tip_pen
        return order_of_paper(self.pen.leds, up) is None

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of the tip, (3,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance)[:3])

    @property
    def intrinsics_sigma(self) -> FloatArray:
        """Standard uncertainties of the camera's intrinsics."""
        at = self.parameters.cameras[0]
        return np.sqrt(np.diag(self.covariance)[at])

    @property
    def led_uncertainty(self) -> FloatArray:
        """U (k = 2) of each LED coordinate, (L, 3), mm."""
        at = self.parameters.leds
        sigmas = np.sqrt(np.diag(self.covariance)[at])
        return COVERAGE_FACTOR * sigmas.reshape(-1, 3)


def discovery_of(
    calibration: Calibration,
    choice: Choice | None,
    lengths: tuple[KnownLength, ...],
    sketch: FloatArray | None,
    second: SecondSwing | None,
    *,
    is_relative: bool,
) -> Discovery:
    """Return the result of a calibration with wide priors.

    ``choice`` is the choice of the lens model, None for a known camera; ``sketch`` (L,
    3), mm, are rough LEDs in the frame that the pen gets.
    """
    bundle, instrument = calibration.bundle, calibration.instrument
    state, tip = bundle.state, calibration.joint.tip_pen
    # The start found the normal, by the same images.
    normals = effect_of_normals(bundle)
    of_turn = inverse(normals.information + FACING**-2 * np.eye(2))
    by, axes = instrument_mixing(bundle), across_normals(state.pen.normals)
    covariance = instrument.covariance + by @ normals.covariance(of_turn) @ by.T
    at = instrument.parameters
    budget = calibration.budget.covariance[:3, :3] - instrument.covariance[:3, :3]
    values, vectors = np.linalg.eigh(budget)
    beyond_fit = (vectors * np.maximum(values, 0.0)) @ vectors.T
    covariance[at.tip, at.tip] += beyond_fit
    pixels = [calibration.observations.pixels[calibration.used]]
    pixels += [] if second is None else [second.observations.pixels]
    marks = np.concatenate([marks_of(each) for each in pixels])
    camera = replace(
        state.rig.cameras[0],
        covariance=covariance[at.cameras[0], at.cameras[0]],
        found=_camera_before(bundle.unknowns.start.rig.cameras[0], marks),
    )
    diameter_sigma = float(np.sqrt(covariance[at.diameter, at.diameter][0, 0]))
    before = bundle.unknowns.start.pen
    assert before.led_covariance is not None
    pen = replace(
        with_led_covariance(state.pen, covariance[at.leds, at.leds]),
        diameter_sigma=diameter_sigma,
        normal_covariance=axes.T @ of_turn @ axes,
        nominal_tip=None,
        expansion=None,
        found=FoundPen(marks, before.diameter, before.led_covariance),
    )
    if not (lengths or is_relative):
        pen = _with_length_found(pen)
    _, R, t = framed(pen, tip, sketch)
    found = Discovery(
        pen=pen,
        camera=camera,
        tip_pen=tip,
        covariance=covariance,
        beyond_fit=beyond_fit,
        calibration=calibration,
        lengths=lengths,
        is_relative=is_relative,
        hypotheses=(),
        n_lamps=0,
        lens_choice=choice,
    )
    return _in_frame(found, R, t)


def _camera_before(start: Camera, marks: FloatArray) -> FoundCamera:
    earlier = start.found
    if earlier is not None:
        return replace(earlier, marks=np.concatenate([earlier.marks, marks]))
    return FoundCamera(marks, start.intrinsics, start.covariance)


def _with_length_found(pen: Pen) -> Pen:
    """Return a pen with its scale, known by two cones, as a prior of other images."""
    assert pen.found is not None
    assert pen.scale_sigma is not None
    first, second, length = farthest_apart(pen.leds)
    longest = KnownLength(first, second, length, length * pen.scale_sigma)
    known = with_lengths_known(pen, (longest,)).led_covariance
    assert known is not None
    return replace(pen, found=replace(pen.found, led_covariance=known))


def with_frame(found: Discovery, origin: int, along: int) -> Discovery:
    """Return what was found with one LED as origin and y to another, by indices."""
    return _in_frame(found, *frame_by(found.pen, origin, along))


def _in_frame(found: Discovery, R: FloatArray, t: FloatArray) -> Discovery:
    at = found.parameters
    turn = np.eye(at.number)
    turn[at.tip, at.tip] = R
    turn[at.leds, at.leds] = np.kron(np.eye(found.pen.n_leds), R)
    covariance = turn @ found.covariance @ turn.T
    return replace(
        found,
        pen=moved(found.pen, R, t),
        tip_pen=R @ found.tip_pen + t,
        covariance=covariance,
        beyond_fit=R @ found.beyond_fit @ R.T,
    )
