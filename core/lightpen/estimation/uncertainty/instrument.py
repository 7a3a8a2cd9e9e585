"""Cameras, pen and tip after a calibration, with their joint covariance.

Errors that the calibration leaves are common to every point that is measured
afterwards, and correlated: an error of the focal length comes with one of the LEDs and
one of the tip. So the covariance covers all parameters jointly.

That is the state of the swing, without what acts when the tip measures.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import Adjustment
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.uncertainty.budget import Budget, ContributionName
from lightpen.estimation.uncertainty.disc_normals import (
    covariance_of_turn,
    effect_of_normals,
)
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
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


def _with_budget_noise(bundle: Bundle, budget: Budget) -> FloatArray:
    """Return the covariance (p, p) of all unknowns with the noise of the budget."""
    noise = next(
        (each for each in budget.shares if each.name is ContributionName.NOISE), None
    )
    if noise is None:
        return bundle.covariance
    covariance, tip = bundle.covariance, bundle.effective[:3]
    images = bundle.information - bundle.jitter_information
    by_images = covariance @ images @ covariance
    factor = np.trace(noise.covariance[:3, :3]) / np.trace(tip @ by_images @ tip.T)
    return np.asarray(covariance + (float(factor) - 1) * by_images)


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
