"""What a calibration leaves to measure with: camera, pen and tip, and how well known.

The images of a swing put camera and pen right as far as they can. What they leave open
is common to every point that is measured afterwards, and hangs together: an error of
the focal length, say, comes with one of the LEDs and one of the tip. So the covariance
is that of all of them together.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.adjustment import Adjustment
from lightpen.estimation.bundle import Bundle
from lightpen.estimation.priors import priors_of
from lightpen.estimation.uncertainty import Budget, ShareName
from lightpen.estimation.unknowns import led_basis
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rig import rig_of


class Parameters(NamedTuple):
    """Where each kind of parameter stands in the covariance of an instrument."""

    tip: slice
    intrinsics: slice
    diameter: slice
    leds: slice


def parameters_of(camera: Camera, pen: Pen) -> Parameters:
    """Return where the parameters of a camera and a pen stand."""
    after_camera = 3 + len(camera.intrinsics)
    return Parameters(
        tip=slice(0, 3),
        intrinsics=slice(3, after_camera),
        diameter=slice(after_camera, after_camera + 1),
        leds=slice(after_camera + 1, after_camera + 1 + 3 * pen.n_leds),
    )


@dataclass(frozen=True, eq=False)
class Instrument:
    """A camera and a pen with its tip.

    Attributes
    ----------
    tip_pen : (3,) array
        mm.
    covariance : (q, q) array
        Of tip, intrinsics, diameter and LEDs, as `parameters` has them.
    sigma : float
        Noise of one image coordinate during the calibration, px.
    """

    camera: Camera
    pen: Pen
    tip_pen: FloatArray
    covariance: FloatArray
    sigma: float

    @property
    def parameters(self) -> Parameters:
        """Where each kind of parameter stands in the covariance."""
        return parameters_of(self.camera, self.pen)


def adjusted_instrument(adjustment: Adjustment, budget: Budget) -> Instrument:
    """Return the instrument that a swing leaves."""
    bundle, allowed = adjustment.bundle, adjustment.allowed
    state = bundle.state
    spread = _noise_counted(allowed, budget)
    held_back = allowed.values - bundle.values
    held_back[:6] = adjustment.held_back
    spread = spread + np.outer(held_back, held_back)
    mixing = _mixing(bundle)
    return Instrument(
        camera=state.rig.cameras[0],
        pen=state.pen,
        tip_pen=state.tip_pen,
        covariance=mixing @ spread @ mixing.T,
        sigma=bundle.sigma,
    )


def instrument_of_files(
    camera: Camera,
    pen: Pen,
    tip_pen: FloatArray,
    tip_covariance: FloatArray,
    sigma: float,
    assumptions: Assumptions = USUAL,
) -> Instrument:
    """Return the instrument of files as they are, its tip independent of them.

    Parameters
    ----------
    tip_pen : (3,) array
        mm.
    tip_covariance : (3, 3) array
        mm^2.
    sigma : float
        Noise of one image coordinate, px.
    """
    at = parameters_of(camera, pen)
    priors = priors_of(rig_of(camera), pen, assumptions)
    covariance = np.zeros((at.leds.stop, at.leds.stop))
    covariance[at.tip, at.tip] = tip_covariance
    covariance[at.intrinsics, at.intrinsics] = priors.cameras[0].covariance
    covariance[at.diameter, at.diameter] = priors.diameter.covariance
    scaling = (pen.leds - pen.leds.mean(axis=0)).ravel()
    basis = led_basis(pen.leds)
    covariance[at.leds, at.leds] = (
        (pen.led_sigma or 0.0) ** 2 * basis @ basis.T
        if pen.led_covariance is None
        else pen.led_covariance
    )
    covariance[at.leds, at.leds] += priors.scale.covariance * np.outer(scaling, scaling)
    return Instrument(camera, pen, tip_pen, covariance, sigma)


def with_camera(instrument: Instrument, camera: Camera) -> Instrument:
    """Return the instrument before another camera, which its swing knows nothing of."""
    old, at = instrument.parameters, parameters_of(camera, instrument.pen)
    moved = np.zeros((at.leds.stop, old.leds.stop))
    for kind in ("tip", "diameter", "leds"):
        place = getattr(old, kind)
        moved[getattr(at, kind), place] = np.eye(place.stop - place.start)
    covariance = moved @ instrument.covariance @ moved.T
    prior = priors_of(rig_of(camera), instrument.pen, USUAL).cameras[0]
    covariance[at.intrinsics, at.intrinsics] = prior.covariance
    return Instrument(
        camera, instrument.pen, instrument.tip_pen, covariance, instrument.sigma
    )


def instrument_record(instrument: Instrument) -> dict[str, Any]:
    """Return an instrument as an entry of a record of a calibration."""
    return {
        "intrinsics": instrument.camera.intrinsics,
        "disc_diameter_mm": instrument.pen.diameter,
        "leds_mm": instrument.pen.leds,
        "covariance": instrument.covariance,
    }


def _noise_counted(allowed: Bundle, budget: Budget) -> FloatArray:
    """Return the covariance of all unknowns with noise as large as the budget's."""
    noise = next((each for each in budget.shares if each.name is ShareName.NOISE), None)
    covariance = allowed.covariance
    if noise is None:
        return covariance
    images = covariance @ (allowed.information - allowed.jitter_information)
    images = images @ covariance
    by_tip = float(np.trace(noise.covariance[:3, :3]) / np.trace(images[:3, :3]))
    return np.asarray(covariance + (by_tip - 1) * images)


def _mixing(bundle: Bundle) -> FloatArray:
    """Return the parameters of an instrument by the unknowns of a bundle, (q, p)."""
    unknowns, state = bundle.unknowns, bundle.state
    at = parameters_of(state.rig.cameras[0], state.pen)
    of = unknowns.columns
    mixing = np.zeros((at.leds.stop, unknowns.number))
    mixing[at.tip, of.tip] = np.eye(3)
    n_intrinsics = at.intrinsics.stop - at.intrinsics.start
    mixing[at.intrinsics, of.cameras[0]] = np.eye(n_intrinsics)
    mixing[at.diameter, of.diameter] = 1.0
    mixing[at.leds, of.leds] = unknowns.basis
    mixing[at.leds, of.scale.start] = unknowns.scaling
    return mixing
