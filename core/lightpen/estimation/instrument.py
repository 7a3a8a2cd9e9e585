"""What a calibration leaves to measure with: cameras, pen and tip, and how well known.

The images of a swing put cameras and pen right as far as they can. What they leave open
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
from lightpen.estimation.priors import Priors, priors_of
from lightpen.estimation.uncertainty import Budget, ShareName
from lightpen.estimation.unknowns import led_basis
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig


class Parameters(NamedTuple):
    """Where each kind of parameter stands in the covariance of an instrument.

    Attributes
    ----------
    cameras : tuple of slice
        Intrinsics of each camera.
    extrinsics : slice
        Where all cameras but the first stand, as `Rig.covariance` has it.
    """

    tip: slice
    cameras: tuple[slice, ...]
    extrinsics: slice
    diameter: slice
    leds: slice

    @property
    def number(self) -> int:
        """How many there are."""
        return int(self.leds.stop)


def parameters_of(rig: Rig, pen: Pen) -> Parameters:
    """Return where the parameters of cameras and a pen stand."""
    sizes = [3, *(len(camera.intrinsics) for camera in rig.cameras)]
    sizes += [6 * (rig.n_cameras - 1), 1, 3 * pen.n_leds]
    ends = np.cumsum(sizes).tolist()
    tip, *cameras, extrinsics, diameter, leds = (
        slice(end - size, end) for size, end in zip(sizes, ends, strict=True)
    )
    return Parameters(tip, tuple(cameras), extrinsics, diameter, leds)


@dataclass(frozen=True, eq=False)
class Instrument:
    """A camera, or several of a rig, and a pen with its tip.

    Attributes
    ----------
    tip_pen : (3,) array
        mm.
    covariance : (q, q) array
        Of tip, cameras, diameter and LEDs, as `parameters` has them.
    sigma : float
        Noise of one image coordinate during the calibration, px.
    """

    rig: Rig
    pen: Pen
    tip_pen: FloatArray
    covariance: FloatArray
    sigma: float

    @property
    def camera(self) -> Camera:
        """The camera, of several the first, in whose frame points are measured."""
        return self.rig.cameras[0]

    @property
    def parameters(self) -> Parameters:
        """Where each kind of parameter stands in the covariance."""
        return parameters_of(self.rig, self.pen)


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
        rig=state.rig,
        pen=state.pen,
        tip_pen=state.tip_pen,
        covariance=mixing @ spread @ mixing.T,
        sigma=bundle.sigma,
    )


def instrument_of_files(
    rig: Rig,
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
    at = parameters_of(rig, pen)
    priors = priors_of(rig, pen, assumptions)
    covariance = np.zeros((at.number, at.number))
    covariance[at.tip, at.tip] = tip_covariance
    _put_cameras(covariance, at, priors)
    covariance[at.diameter, at.diameter] = priors.diameter.covariance
    scaling = (pen.leds - pen.leds.mean(axis=0)).ravel()
    basis = led_basis(pen.leds)
    covariance[at.leds, at.leds] = (
        (pen.led_sigma or 0.0) ** 2 * basis @ basis.T
        if pen.led_covariance is None
        else pen.led_covariance
    )
    covariance[at.leds, at.leds] += priors.scale.covariance * np.outer(scaling, scaling)
    return Instrument(rig, pen, tip_pen, covariance, sigma)


def with_rig(instrument: Instrument, rig: Rig) -> Instrument:
    """Return the instrument before other cameras, which its swing knows nothing of."""
    old, at = instrument.parameters, parameters_of(rig, instrument.pen)
    moved = np.zeros((at.number, old.number))
    for kind in ("tip", "diameter", "leds"):
        place = getattr(old, kind)
        moved[getattr(at, kind), place] = np.eye(place.stop - place.start)
    covariance = moved @ instrument.covariance @ moved.T
    _put_cameras(covariance, at, priors_of(rig, instrument.pen, USUAL))
    return Instrument(
        rig, instrument.pen, instrument.tip_pen, covariance, instrument.sigma
    )


def instrument_record(instrument: Instrument) -> dict[str, Any]:
    """Return an instrument as an entry of a record of a calibration."""
    rig = instrument.rig
    record = {
        "intrinsics": instrument.camera.intrinsics,
        "disc_diameter_mm": instrument.pen.diameter,
        "leds_mm": instrument.pen.leds,
        "covariance": instrument.covariance,
    }
    if rig.n_cameras == 1:
        return record
    others = zip(rig.cameras, rig.rotations, rig.translations, strict=True)
    return record | {
        "other_cameras": [
            {
                "intrinsics": camera.intrinsics,
                "cam_from_rig_rotation": rotation,
                "cam_from_rig_translation_mm": translation,
            }
            for camera, rotation, translation in list(others)[1:]
        ]
    }


def _put_cameras(covariance: FloatArray, at: Parameters, priors: Priors) -> None:
    """Put what the files know of cameras into a covariance."""
    for place, prior in zip(at.cameras, priors.cameras, strict=True):
        covariance[place, place] = prior.covariance
    if priors.extrinsics is not None:
        covariance[at.extrinsics, at.extrinsics] = priors.extrinsics.covariance


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
    at = parameters_of(state.rig, state.pen)
    of = unknowns.columns
    mixing = np.zeros((at.number, unknowns.number))
    kinds = ("tip", "extrinsics", "diameter")
    alike = [(getattr(at, kind), getattr(of, kind)) for kind in kinds]
    for place, column in (*alike, *zip(at.cameras, of.cameras, strict=True)):
        mixing[place, column] = np.eye(place.stop - place.start)
    mixing[at.leds, of.leds] = unknowns.basis
    mixing[at.leds, of.scale.start] = unknowns.scaling
    return mixing
