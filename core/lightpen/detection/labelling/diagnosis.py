"""Diagnosis of LEDs that are not where the pen file has them: the likely cause."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.labelling.labels import MODERATE, label_images
from lightpen.detection.spots import Spots
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

N_DIAGNOSED = 4  # images
MOSTLY = 0.8  # of the spots that may be LEDs
UNIT_FACTORS = (1000.0, 0.001, 25.4, 1 / 25.4, 10.0, 0.1, 100.0, 0.01)
DISC_FACTORS = (0.6, 1.6, 0.4, 2.5)
FOCAL_FACTORS = (0.9, 1.1, 0.8, 1.25, 0.7, 1.4, 0.5, 2.0)


def diagnose(spots: Sequence[Spots], camera: Camera, pen: Pen) -> Message | None:
    """Name the likely cause why LEDs are not found where the pen file has them.

    Pens and cameras with one thing changed are tried on a few images; the first that
    explains clearly more spots shows. None if most spots are LEDs of the pen.
    """
    needed = certain_leds(pen)
    counts = np.array([len(s) for s in spots])
    if 2 * np.sum(counts >= needed) < len(spots):
        return message(
            "diagnosis.few-spots",
            n_needed=needed,
            median=float(np.median(counts)),
            n_leds=pen.n_leds,
        )
    sample = _Sample.of(spots, camera, pen)
    if sample.is_explained:
        return None
    for wrong in (_mirror, _unit, _disc, _focal_length):
        cause = wrong(camera, pen, sample.fits)
        if cause:
            return cause
    return message("diagnosis.spots-do-not-fit", n_needed=needed, n_leds=pen.n_leds)


def diagnose_mirror(spots: Sequence[Spots], camera: Camera, pen: Pen) -> Message | None:
    """Return a message if a mirrored pen explains clearly more of the spots.

    Most LEDs of the mirror image of a nearly symmetric pen can be labelled, so this is
    checked if some LEDs are missing in all images.
    """
    sample = _Sample.of(spots, camera, pen)
    return None if sample.is_explained else _mirror(camera, pen, sample.fits)


_Fits = Callable[[Camera, Pen], bool]


@dataclass(frozen=True, eq=False)
class _Sample:
    """A few images, with the number of spots that the pen explains."""

    spots: list[Spots]
    n_possible: int
    n_explained: int

    @classmethod
    def of(cls, spots: Sequence[Spots], camera: Camera, pen: Pen) -> "_Sample":
        needed = certain_leds(pen)
        # The images with the fewest spots have the least clutter.
        some = sorted((s for s in spots if len(s) >= needed), key=len)[:N_DIAGNOSED]
        return cls(
            some,
            sum(min(len(s), pen.n_leds) for s in some),
            _n_explained(some, camera, pen),
        )

    @property
    def is_explained(self) -> bool:
        return self.n_explained > MOSTLY * self.n_possible

    def fits(self, camera: Camera, pen: Pen) -> bool:
        """Return whether this camera and pen explain the spots, and clearly better."""
        n = _n_explained(self.spots, camera, pen)
        return n > MOSTLY * self.n_possible and n >= self.n_explained + len(self.spots)


def _n_explained(spots: Sequence[Spots], camera: Camera, pen: Pen) -> int:
    labels = label_images(spots, camera, pen, MODERATE)
    return sum(int((label.spot >= 0).sum()) for label in labels)


def _mirror(camera: Camera, pen: Pen, fits: _Fits) -> Message | None:
    for sign, name in (([-1.0, 1.0, 1.0], "x"), ([1.0, 1.0, -1.0], "z")):
        if fits(camera, replace(pen, leds=pen.leds * np.array(sign))):
            return message("diagnosis.mirror", axis=name)
    return None


def _unit(camera: Camera, pen: Pen, fits: _Fits) -> Message | None:
    for factor in UNIT_FACTORS:
        if fits(camera, replace(pen, leds=pen.leds * factor)):
            return message("diagnosis.unit", factor=factor)
    return None


def _disc(camera: Camera, pen: Pen, fits: _Fits) -> Message | None:
    for factor in DISC_FACTORS:
        if fits(camera, replace(pen, diameter=pen.diameter * factor)):
            return message("diagnosis.disc", factor=factor, diameter=pen.diameter)
    return None


def _focal_length(camera: Camera, pen: Pen, fits: _Fits) -> Message | None:
    for factor in FOCAL_FACTORS:
        changed = replace(camera, fx=camera.fx * factor, fy=camera.fy * factor)
        if fits(changed, pen):
            return message("diagnosis.focal-length", factor=factor)
    return None
