"""Cameras, pen and tip after a calibration, with their joint covariance.

Errors that the calibration leaves are common to every point that is measured
afterwards, and correlated: an error of the focal length comes with one of the LEDs and
one of the tip. So the covariance covers all parameters jointly.

That is the state of the swing. `in_use` adds what acts when the tip measures.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import Adjustment
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.priors import (
    Prior,
    Priors,
    priors_of,
    temperature_prior,
    thermal_growth,
)
from lightpen.estimation.bundle.unknowns import led_basis
from lightpen.estimation.uncertainty.budget import Budget, ContributionName
from lightpen.estimation.uncertainty.disc_normals import (
    covariance_of_turn,
    effect_of_normals,
)
from lightpen.messages import Message, message
from lightpen.model.bending import ASSUMED_BENDING, Bending
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.limits import USUAL, Assumptions
from lightpen.model.pen import Pen, grown
from lightpen.model.rigid import UPRIGHT_AXIS, Rig


class Parameters(NamedTuple):
    """Indices of each kind of parameter in the covariance of an instrument."""

    tip: slice
    cameras: tuple[slice, ...]  # intrinsics of each camera
    extrinsics: slice  # extrinsics of all cameras but the first, as in `Rig.covariance`
    diameter: slice
    leds: slice

    @property
    def number(self) -> int:
        """Their number."""
        return int(self.leds.stop)


def parameters_of(rig: Rig, pen: Pen) -> Parameters:
    """Return the indices of the parameters of cameras and a pen."""
    sizes = [3, *(len(camera.intrinsics) for camera in rig.cameras)]
    sizes += [6 * (rig.n_cameras - 1), 1, 3 * pen.n_leds]
    ends = np.cumsum(sizes).tolist()
    tip, *cameras, extrinsics, diameter, leds = (
        slice(end - size, end) for size, end in zip(sizes, ends, strict=True)
    )
    return Parameters(tip, tuple(cameras), extrinsics, diameter, leds)


class PenScale(NamedTuple):
    """Relative scale s of a pen during the swing that calibrated its tip.

    With the scale of the LED file, of which ``file_sigma`` is the standard uncertainty.
    """

    growth: float  # of the pen about its tip against the LED file
    file_sigma: float
    thermal_sigma: float  # standard uncertainty of the growth by temperature
    deviation: float  # estimate of s by the swing, 0 if it does not determine it
    variance: float  # of s by the swing
    covariance: FloatArray  # (q,), of all parameters with s

    @property
    def lasting(self) -> float:
        """Fraction of s that belongs to the LED file, and not to temperature."""
        total = self.file_sigma**2 + self.thermal_sigma**2
        return self.file_sigma**2 / total if total > 0 else 1.0


@dataclass(frozen=True, eq=False)
class Instrument:
    """A camera, or several of a rig, and a pen with its tip."""

    rig: Rig
    pen: Pen
    tip_pen: FloatArray  # (3,), mm
    # (q, q), of tip, cameras, diameter and LEDs, as `parameters` has them.
    covariance: FloatArray
    sigma: float  # noise of one image coordinate during the calibration, px
    scale: PenScale
    # Standard uncertainty of the bending of a touch across the pen, mm
    bending: float = 0.0
    remarks: tuple[Message, ...] = ()  # on scale and bending, for the user

    @property
    def camera(self) -> Camera:
        """The camera in whose frame points are measured, the first of a rig."""
        return self.rig.cameras[0]

    @property
    def parameters(self) -> Parameters:
        """Indices of each kind of parameter in the covariance."""
        return parameters_of(self.rig, self.pen)

    @property
    def seated(self) -> "Instrument":
        """The same with its tip in a cone, where the stylus bends as in the swing."""
        return with_bending(self, 0.0)


def adjusted_instrument(adjustment: Adjustment, budget: Budget) -> Instrument:
    """Return the instrument as adjusted by a swing, at the scale of the pen in it."""
    bundle, state = adjustment.bundle, adjustment.bundle.state
    spread = _with_budget_noise(bundle, budget)
    for at, prior in zip(
        bundle.layout.cameras, bundle.unknowns.priors.cameras, strict=True
    ):
        if prior.beyond is not None:
            gain = bundle.covariance[:, at] @ bundle.prior_information[at, at]
            spread = spread + gain @ prior.beyond @ gain.T
    of_turn = covariance_of_turn(state.pen)
    if of_turn is not None and state.rig.n_cameras == 1:
        spread = spread + effect_of_normals(bundle).covariance(of_turn)
    mixing = instrument_mixing(bundle)
    by_scale = spread[:, bundle.layout.scale.start]
    priors = bundle.unknowns.priors
    return Instrument(
        rig=state.rig,
        pen=state.pen,
        tip_pen=bundle.tip_pen,
        covariance=mixing @ spread @ mixing.T,
        sigma=bundle.sigma,
        scale=PenScale(
            growth=bundle.scale,
            file_sigma=priors.scale.sigma,
            thermal_sigma=priors.temperature.sigma,
            deviation=bundle.scale - priors.growth,
            variance=float(by_scale[bundle.layout.scale.start]),
            covariance=mixing @ by_scale,
        ),
    )


def with_bending(instrument: Instrument, bending: float) -> Instrument:
    """Return the instrument with another bending of the touch, mm.

    The bending of the swing, which is another, moved the tip along the pen.
    """
    at, covariance = instrument.parameters.tip, instrument.covariance.copy()
    change = bending**2 - instrument.bending**2
    covariance[at, at] += change * np.outer(UPRIGHT_AXIS, UPRIGHT_AXIS)
    return replace(instrument, covariance=covariance, bending=bending)


def scale_direction(instrument: Instrument) -> FloatArray:
    """Return the derivative of the parameters by the scale of the pen, (q,).

    The pen grows about its tip, which keeps the scale of the LED file.
    """
    at = instrument.parameters
    by_scale = np.zeros(at.number)
    by_scale[at.leds] = (instrument.pen.leds - instrument.tip_pen).ravel()
    return by_scale


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


def _with_budget_noise(bundle: Bundle, budget: Budget) -> FloatArray:
    """Return the covariance (p, p) of all unknowns with the noise of the budget."""
    noise = next(
        (each for each in budget.shares if each.name is ContributionName.NOISE), None
    )
    if noise is None:
        return bundle.covariance
    by_images, tip = _by_images(bundle), bundle.effective[:3]
    factor = float(
        np.trace(noise.covariance[:3, :3]) / np.trace(tip @ by_images @ tip.T)
    )
    return np.asarray(bundle.covariance + (factor - 1) * by_images)


def _by_images(bundle: Bundle) -> FloatArray:
    """Return the covariance (p, p) by independent noise with which LEDs are weighed."""
    covariance = bundle.covariance
    information = bundle.information - bundle.jitter_information
    return np.asarray(covariance @ information @ covariance)


def instrument_mixing(bundle: Bundle) -> FloatArray:
    """Return the parameters of an instrument by the unknowns of a bundle, (q, p)."""
    unknowns, state = bundle.unknowns, bundle.state
    at = parameters_of(state.rig, state.pen)
    of = unknowns.layout
    mixing = np.zeros((at.number, unknowns.number))
    mixing[at.tip] = bundle.effective[:3]
    kinds = ("extrinsics", "diameter")
    alike = [(getattr(at, kind), getattr(of, kind)) for kind in kinds]
    for place, column in (*alike, *zip(at.cameras, of.cameras, strict=True)):
        mixing[place, column] = np.eye(place.stop - place.start)
    mixing[at.leds, of.leds] = unknowns.basis
    mixing[at.leds, of.scale.start] = unknowns.scaling
    return mixing


# An instrument as it measures: what acts on it then, and did not in its swing.
#
# The effective tip is the point in the scale of the LED file that a swing determines,
# with the bending of the swing. When the tip measures, scale and temperature let the
# pen grow about its tip, and each touch bends the stylus in a way of its own.


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
