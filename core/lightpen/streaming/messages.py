"""A pose of the pen and its tip as messages of OpenIGTLink [1]_, with covariances.

A message is of version 3 of the protocol, which has room for what is known besides a
transform: it stands in the message's metadata, as text.

References
----------
.. [1] J. Tokuda et al., "OpenIGTLink: an open network protocol for image-guided therapy
   environment", Int. J. Med. Robot. 5 (2009) 423-434.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.sighting import Sighting
from lightpen.estimation.instrument import Instrument
from lightpen.record.names import Names
from lightpen.verification.touch import StillFrames, TouchFrame, measure_touches

PEN, TIP = "PenToCamera", "TipToCamera"  # names of devices, at most 20 letters
WITH_METADATA = 2  # version of the header


@dataclass(frozen=True, eq=False)
class StreamedTip:
    """The tip whose place is streamed.

    Attributes
    ----------
    instrument : Instrument
        Camera and pen with the tip, and how well all of them are known.
    """

    names: Names
    instrument: Instrument


def pose_messages(
    sighting: Sighting, tip: StreamedTip | None, number: int, at: float
) -> bytes:
    """Return the pose of a pen that was seen, and the place of its tip, as sent.

    Parameters
    ----------
    tip : StreamedTip or None
        None where no tip is in force: then there is the pose alone.
    number : int
        Of the image.
    at : float
        When it was taken, s since 1970 in UTC.
    """
    told = {"Image": str(number), "Units": "mm rad"}
    sigma = sighting.sigma if tip is None else _sigma(sighting, tip.instrument)
    covariance = sighting.cofactors * sigma**2
    R = sighting.rotation
    sent = _transform(
        *(PEN, R, sighting.translation, at),
        {**told, **_covariance(covariance, "rx ry rz x y z")},
    )
    if tip is None:
        return sent
    place, spread = _place_of_tip(sighting, tip.instrument)
    named = {"Pen": tip.names.pen, "Tip": tip.names.tip}
    return sent + _transform(
        TIP, R, place, at, {**told, **named, **_covariance(spread, "x y z")}
    )


def _sigma(sighting: Sighting, instrument: Instrument) -> float:
    """Return the noise of one image coordinate, px: one image tells little of it."""
    return float(np.fmax(sighting.sigma, instrument.sigma))


def _place_of_tip(
    sighting: Sighting, instrument: Instrument
) -> tuple[FloatArray, FloatArray]:
    """Return the tip in the camera, mm, and its covariance, not of noise alone."""
    pixels = np.full((instrument.rig.n_cameras, *sighting.pixels.shape), np.nan)
    pixels[0] = sighting.pixels  # of the first camera, whose images are streamed
    frame = TouchFrame("", pixels, sighting.rotation, sighting.translation)
    (touch,) = measure_touches(instrument, [StillFrames((frame,))])
    return touch.point_cam, touch.covariance(instrument)


def _covariance(covariance: FloatArray, order: str) -> dict[str, str]:
    """Return a covariance row by row; nothing of one that is not known."""
    if not np.isfinite(covariance).all():
        return {}
    numbers = " ".join(f"{value:.9g}" for value in covariance.ravel().tolist())
    return {"Covariance": numbers, "CovarianceOrder": order}


def _transform(
    name: str, R: FloatArray, t: FloatArray, at: float, told: Mapping[str, str]
) -> bytes:
    # Not there without the extra "stream", and not needed before somebody listens.
    from pyigtl import TransformMessage

    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, t
    message = TransformMessage(matrix, timestamp=at, device_name=name)
    message.header_version = WITH_METADATA
    # WORKAROUND for pyigtl 0.3.4: it fails on texts that are not ASCII.
    message.metadata = {
        key: text.encode("ascii", "backslashreplace").decode()
        for key, text in told.items()
    }
    return bytes(message.pack())
