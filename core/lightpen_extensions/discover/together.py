"""Several swings of one pen before one camera, adjusted together.

Each swing is adjusted by itself. What they found is joined by its information, in which
the lengths, which all of them share, count once; so it is the adjustment of all images
to first order. The last swing, held out, is the proof: it is compared with the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.unknowns import whole_moves
from lightpen.model.camera import Camera
from lightpen.model.coverage import inverse, known_by, symmetric_root
from lightpen.model.pen import Pen
from lightpen.model.rigid import fit_rigid
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.scale import (
    MeasuredLength,
    Request,
    with_led_covariance,
)
from lightpen_extensions.discover.starts import any_camera, gradient_of
from lightpen_extensions.discover.tracks import Report, Sightings

CONTRADICTING = 4.0  # standard deviations of a held-out swing
OF_OTHER_PEN = ("discover.sketch-count", "discover.other-sketch")


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A held-out swing, compared with the others.

    The common error of the lengths is no part of the differences.
    """

    tip: FloatArray  # (3,), difference of the tips, mm
    tip_sigma: FloatArray  # (3,), standard uncertainty, mm
    focal_length: float  # difference of fx, px
    focal_length_sigma: float

    @property
    def worst(self) -> float:
        """The largest difference in standard deviations."""
        tip = float(np.abs(self.tip / self.tip_sigma).max())
        return max(tip, abs(self.focal_length) / self.focal_length_sigma)


@dataclass(frozen=True, eq=False)
class Together:
    """Joint result of several swings."""

    found: Discovery  # of all; its calibration is of the first swing
    swings: tuple[Discovery, ...]  # of each
    held_out: HeldOut  # the last swing against the others


def discover_together(
    swings: Sequence[Sightings],
    request: Request,
    report: Report = lambda fraction: None,
) -> Together:
    """Find tip, pen and camera by two or more swings of the same pen and tip.

    Raises `CalibrationError` if a swing determines nothing, or the last contradicts the
    others.
    """
    for k, sightings in enumerate(swings):
        if sightings.size != swings[0].size:
            raise CalibrationError("discover.other-size", number=k + 1)
    found: list[Discovery] = []
    for k, sightings in enumerate(swings):
        own = request if not found else _again(request, found[0])
        try:
            own_report = partial(_report_part, report, k, len(swings))
            found.append(discover(sightings, own, own_report))
        except CalibrationError as error:
            if found and error.message.code in OF_OTHER_PEN:
                raise CalibrationError("discover.other-pen", number=k + 1) from error
            raise
    sizes = [len(each.camera.distortion) for each in found]
    for k, size in enumerate(sizes):
        if size != max(sizes):  # a swing shows the lens where the LEDs were
            own = replace(_again(request, found[0]), n_coefficients=max(sizes))
            found[k] = discover(swings[k], own)
            if len(found[k].camera.distortion) != max(sizes):
                raise CalibrationError("discover.other-lens", number=k + 1)
    held_out = _compared(joined(found[:-1]), found[-1])
    if held_out.worst > CONTRADICTING:
        raise CalibrationError(
            "discover.swings-contradict",
            tip=float(np.linalg.norm(held_out.tip)),
            times=held_out.worst,
        )
    return Together(joined(found), tuple(found), held_out)


def _again(request: Request, first: Discovery) -> Request:
    """Return the request of a later swing: numbers, frame and lengths of the first."""
    if request.touched is not None:
        lengths = (
            MeasuredLength((each.first + 1, each.second + 1), each.length, each.sigma)
            for each in first.lengths
        )
        request = replace(request, lengths=tuple(lengths), touched=None)
    return replace(request, sketch=first.pen)


def _report_part(report: Report, k: int, n: int, fraction: float) -> None:
    report((k + fraction) / n)


def joined(swings: Sequence[Discovery]) -> Discovery:
    """Return the joint result of swings, in the frame of the first.

    Prior information on camera and discs counts once: each swing adds the information
    of its images, which is its total less the prior. Uncertainty beyond the fits (the
    lens) counts as common to all swings up to the amount that all have, and as
    independent beyond that.
    """
    first, at = swings[0], swings[0].parameters
    if len(swings) == 1:
        return first
    basis = _free_of(first)
    beyond_fit = reduce(common_part, [each.beyond_fit for each in swings])
    parts = [_parted(each, beyond_fit) for each in swings]
    start = _values(first, first)
    information = basis.T @ _prior_information(first) @ basis
    right = information @ basis.T @ (_prior_values(first) - start)
    for each, part in zip(swings, parts, strict=True):
        prior = basis.T @ _prior_information(each) @ basis
        of_images = _not_negative(inverse(basis.T @ part.own @ basis) - prior)
        values = _values(each, first)
        begun = basis.T @ (values - _started_at(each, values))
        information += of_images
        right += of_images @ basis.T @ (values - start) + prior @ begun
    covariance = inverse(information)
    whole = start + basis @ covariance @ right
    shared = np.mean([each.shared for each in parts], axis=0)
    spread = basis @ covariance @ basis.T + shared
    pen = replace(
        first.pen,
        leds=whole[at.leds].reshape(-1, 3),
        diameter=float(whole[at.diameter][0]),
        diameter_sigma=float(np.sqrt(spread[at.diameter, at.diameter][0, 0])),
    )
    pen = with_led_covariance(pen, spread[at.leds, at.leds])
    camera = first.camera.with_intrinsics(whole[at.cameras[0]])
    camera = replace(camera, covariance=spread[at.cameras[0], at.cameras[0]])
    pen, camera = _found_from_all(pen, camera, swings)
    return replace(
        first,
        pen=pen,
        camera=camera,
        tip_pen=whole[at.tip],
        covariance=spread,
        beyond_fit=beyond_fit,
    )


def _found_from_all(
    pen: Pen, camera: Camera, swings: Sequence[Discovery]
) -> tuple[Pen, Camera]:
    """Return pen and camera with the marks of the images of all swings."""
    assert pen.found is not None
    assert camera.found is not None
    marks = [each.pen.found.marks for each in swings if each.pen.found is not None]
    every = np.concatenate(marks)
    return (
        replace(pen, found=replace(pen.found, marks=every)),
        replace(camera, found=replace(camera.found, marks=every)),
    )


def _compared(others: Discovery, last: Discovery) -> HeldOut:
    """Compare a swing with others; the length of all is the same, and cancels."""
    at = others.parameters
    difference = _values(last, others) - _values(others, others)
    beyond_fit = common_part(others.beyond_fit, last.beyond_fit)
    covariance = _parted(others, beyond_fit).own + _parted(last, beyond_fit).own
    sigmas = np.sqrt(np.diag(covariance))
    fx = at.cameras[0].start
    return HeldOut(
        tip=difference[at.tip],
        tip_sigma=sigmas[at.tip],
        focal_length=float(difference[fx]),
        focal_length_sigma=float(sigmas[fx]),
    )


def _values(each: Discovery, frame: Discovery) -> FloatArray:
    """Return the parameters, (q,), in the frame of another discovery."""
    at = each.parameters
    R, t = fit_rigid(each.pen.leds, frame.pen.leds)
    values = np.empty(at.number)
    values[at.tip] = R @ each.tip_pen + t
    values[at.cameras[0]] = each.camera.intrinsics
    values[at.diameter] = each.pen.diameter
    values[at.leds] = (each.pen.leds @ R.T + t).ravel()
    return values


def _prior_information(each: Discovery) -> FloatArray:
    """Return the prior information of camera and discs, (q, q)."""
    at, priors = each.parameters, each.calibration.priors
    information = np.zeros((at.number, at.number))
    camera = at.cameras[0]
    information[camera, camera] = known_by(priors.cameras[0].covariance)
    information[at.diameter, at.diameter] = known_by(priors.diameter.covariance)
    return information


def _prior_values(each: Discovery) -> FloatArray:
    """Return the parameters, (q,), with camera and discs at their prior means."""
    values = _started_at(each, _values(each, each))
    if each.lens_choice is not None:  # else the camera is from a file
        values[each.parameters.cameras[0]] = any_camera(each.camera).intrinsics
    return values


def _started_at(each: Discovery, values: FloatArray) -> FloatArray:
    """Return the parameters, (q,), with camera and discs at their initial values."""
    start, values = each.calibration.bundle.unknowns.start, values.copy()
    values[each.parameters.cameras[0]] = start.rig.cameras[0].intrinsics
    values[each.parameters.diameter] = start.pen.diameter
    return values


def _not_negative(information: FloatArray) -> FloatArray:
    """Return information, (q, q), without eigenvalues below 0 by rounding."""
    units = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(information / np.outer(units, units))
    scaled = units[:, None] * vectors
    return np.asarray((scaled * np.maximum(values, 0.0)) @ scaled.T)


class _Parts(NamedTuple):
    """Covariance of a discovery, (q, q) each: its own part, and the part of all."""

    own: FloatArray
    shared: FloatArray


def _parted(each: Discovery, beyond_fit: FloatArray) -> _Parts:
    """Split off the covariance by lengths and by tip errors beyond the fit, (3, 3)."""
    at, lengths = each.parameters, _length_rows(each)
    beyond = np.zeros_like(each.covariance)
    beyond[at.tip, at.tip] = beyond_fit
    own = each.covariance - beyond
    gain = own @ lengths
    by_lengths = gain @ np.linalg.pinv(lengths.T @ gain) @ gain.T
    return _Parts(own - by_lengths, beyond + by_lengths)


def common_part(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the part (k, k) that two covariances have in common; each exceeds it."""
    root = symmetric_root(one + other)
    white = np.linalg.pinv(root)
    shares, axes = np.linalg.eigh(white @ one @ white.T)
    spread = root @ axes
    return np.asarray(
        (spread * np.clip(np.minimum(shares, 1 - shares), 0, 1)) @ spread.T
    )


def _length_rows(each: Discovery) -> FloatArray:
    """Return the derivatives of the lengths by all parameters, (q, m)."""
    at = each.parameters
    rows = np.zeros((at.number, len(each.lengths)))
    for k, known in enumerate(each.lengths):
        rows[at.leds, k] = gradient_of(each.pen.leds, known)
    return rows


def _free_of(each: Discovery) -> FloatArray:
    """Return a basis of the parameters without lengths and moves of the whole pen."""
    at = each.parameters
    moves = np.zeros((at.number, 6))
    moves[at.leds] = whole_moves(each.pen.leds)
    held = np.concatenate([moves, _length_rows(each)], axis=1)
    complete = np.linalg.qr(held, mode="complete")[0]
    return np.asarray(complete[:, held.shape[1] :])
