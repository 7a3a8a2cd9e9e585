"""Instruments as they measure: of files, and with what acts in use and not in a swing.

The effective tip is the point in the scale of the LED file that a swing determines,
with the bending of the swing. When the tip measures, scale and temperature let the
pen grow about its tip, and each touch bends the stylus in a way of its own.
"""

from dataclasses import replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.detection.rig_observations import fit_rig_poses
from lightpen.estimation.bundle.priors import (
    Prior,
    Priors,
    priors_of,
    temperature_prior,
    thermal_growth,
)
from lightpen.estimation.bundle.unknowns import led_basis
from lightpen.estimation.uncertainty.instrument import (
    Instrument,
    Parameters,
    PenScale,
    parameters_of,
    with_bending,
)
from lightpen.messages import Message, message
from lightpen.model.bending import ASSUMED_BENDING, Bending
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.limits import USUAL, Assumptions
from lightpen.model.pen import Pen, grown
from lightpen.model.rigid import Rig

METRE = 1000.0  # mm


def in_use(
    instrument: Instrument,
    pen: Pen,
    assumptions: Assumptions,
    bending: Bending = ASSUMED_BENDING,
) -> Instrument:
    """Return an instrument as it measures, with what acts on it then.

    Let s be the scale of the pen in the swing. Of it the LED file keeps
    `PenScale.lasting`; the rest was temperature, and that of the measurement takes its
    place. The bending of a touch is independent of that in the swing, which moved the
    effective tip along the pen.

    Parameters
    ----------
    pen : Pen
        As in the LED file.
    assumptions : Assumptions
        With the temperature of the pen while it measures, if it is known.
    """
    scale = instrument.scale
    lasting, lost = scale.lasting, 1 - scale.lasting
    by_scale = scale_direction(instrument)
    temperature = temperature_prior(pen, assumptions)
    # Of the LED file, given s; and of the temperature.
    fresh = lost * scale.file_sigma**2 + temperature.sigma**2
    crossed = np.outer(by_scale, scale.covariance)
    covariance = instrument.covariance - lost * (crossed + crossed.T)
    covariance += (lost**2 * scale.variance + fresh) * np.outer(by_scale, by_scale)
    scale_sigma = float(np.sqrt(lasting**2 * scale.variance + fresh))
    growth = (1 + thermal_growth(pen, assumptions)) * (1 + lasting * scale.deviation)
    change = growth / (1 + scale.growth) - 1
    grown_one = replace(
        instrument,
        pen=grown(instrument.pen, change, instrument.tip_pen),
        covariance=covariance,
        remarks=(_scale_words(scale_sigma, temperature), bending.words),
    )
    return with_bending(grown_one, bending.sigma)


def _scale_words(sigma: float, temperature: Prior) -> Message:
    """Return what the scale adds to a length, and what would make it less."""
    added = COVERAGE_FACTOR * METRE * sigma
    if temperature.assumed:
        return message("use.temperature-assumed", added=added)
    return message("use.scale", added=added)


def instrument_of_files(
    rig: Rig, pen: Pen, tip_pen: FloatArray, tip_covariance: FloatArray, sigma: float
) -> Instrument:
    """Return the instrument of files as they are, its tip independent of them.

    ``tip_covariance`` (3, 3) is in mm^2, ``sigma`` the noise of one image coordinate,
    px.
    """
    at = parameters_of(rig, pen)
    priors = priors_of(rig, pen, USUAL)
    covariance = np.zeros((at.number, at.number))
    covariance[at.tip, at.tip] = tip_covariance
    _put_cameras(covariance, at, priors)
    covariance[at.diameter, at.diameter] = priors.diameter.covariance
    basis = led_basis(pen.leds)
    covariance[at.leds, at.leds] = (
        (pen.led_sigma or 0.0) ** 2 * basis @ basis.T
        if pen.led_covariance is None
        else pen.led_covariance
    )
    scale = PenScale(
        growth=0.0,
        file_sigma=priors.scale.sigma,
        thermal_sigma=0.0,
        deviation=0.0,
        variance=priors.scale.sigma**2,
        covariance=np.zeros(at.number),
    )
    files = Instrument(rig, pen, tip_pen, covariance, sigma, scale)
    by_scale = scale_direction(files)
    crossed = scale.variance * by_scale
    return replace(
        files,
        covariance=covariance + np.outer(by_scale, crossed),
        scale=scale._replace(covariance=crossed),
    )


def with_rig(instrument: Instrument, rig: Rig) -> Instrument:
    """Return the instrument with another rig."""
    old, at = instrument.parameters, parameters_of(rig, instrument.pen)
    moved = np.zeros((at.number, old.number))
    for kind in ("tip", "diameter", "leds"):
        place = getattr(old, kind)
        moved[getattr(at, kind), place] = np.eye(place.stop - place.start)
    covariance = moved @ instrument.covariance @ moved.T
    _put_cameras(covariance, at, priors_of(rig, instrument.pen, USUAL))
    by_scale = moved @ instrument.scale.covariance
    return replace(
        instrument,
        rig=rig,
        covariance=covariance,
        scale=instrument.scale._replace(covariance=by_scale),
    )


def _put_cameras(covariance: FloatArray, at: Parameters, priors: Priors) -> None:
    """Put the priors of cameras into a covariance."""
    for place, prior in zip(at.cameras, priors.cameras, strict=True):
        covariance[place, place] = prior.covariance
    if priors.extrinsics is not None:
        covariance[at.extrinsics, at.extrinsics] = priors.extrinsics.covariance


def scale_direction(instrument: Instrument) -> FloatArray:
    """Return the derivative of the parameters by the scale of the pen, (q,).

    The pen grows about its tip, which keeps the scale of the LED file.
    """
    at = instrument.parameters
    by_scale = np.zeros(at.number)
    by_scale[at.leds] = (instrument.pen.leds - instrument.tip_pen).ravel()
    return by_scale


def see_together(rig: Rig, pen: Pen, detection: PenDetection) -> PenDetection:
    """Return the detection of a moment with one pose rig_from_pen by all cameras.

    A camera without a pose, or with a blurred image, is ignored; if none is left, the
    detection is returned as it is.
    """
    views = (detection, *detection.others)
    if len(views) == 1:
        return detection
    fit = [view.has_pose and not view.is_blurred for view in views]
    if not any(fit):
        return detection
    nowhere = np.full_like(detection.pixels, np.nan)
    clean = [
        view if is_fit else replace(view, pixels=nowhere)
        for view, is_fit in zip(views, fit, strict=True)
    ]
    start = fit.index(True)
    back = rig.rotations[start].T
    poses = fit_rig_poses(
        rig,
        pen,
        np.stack([view.pixels for view in clean])[None],
        (back @ views[start].rotation)[None],
        (back @ (views[start].translation - rig.translations[start]))[None],
    )
    return replace(
        clean[0],
        reason=Reason.NONE,
        rotation=poses.rotations[0],
        translation=poses.translations[0],
        cofactors=poses.covariances[0] / poses.sigma**2,
        sigma=poses.sigma,
        spots=views[start].spots,
        labels=views[start].labels,
        others=tuple(clean[1:]),
    )
