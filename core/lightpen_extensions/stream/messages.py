"""A pose of the pen and its tip as messages of OpenIGTLink [1]_, with covariances.

A message is of version 3 of the protocol, which has room for what is known besides a
transform: it stands in the message's metadata, as text.

References
----------
.. [1] J. Tokuda et al., "OpenIGTLink: an open network protocol for image-guided therapy
   environment", Int. J. Med. Robot. 5 (2009) 423-434.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import PenDetection
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.record.calibrations import CalibrationFile, status_of
from lightpen.record.swings.header import Names
from lightpen_extensions.measure.tasks.probed_point import (
    ProbingFrame,
    StillFrames,
    measure_touches,
)

PEN, TIP = "PenToCamera", "TipToCamera"  # names of devices, at most 20 letters
WITH_METADATA = 2  # version of the header


@dataclass(frozen=True, eq=False)
class StreamedTip:
    """The tip of the stream."""

    names: Names
    instrument: Instrument
    metadata: Mapping[str, str] = field(default_factory=dict)  # see `tip_metadata`


def tip_metadata(file: CalibrationFile) -> dict[str, str]:
    """Return origin, verdict, due date and status of a tip, as far as known."""
    entries = {
        "Origin": file.origin or "",
        "Verdict": file.grade.value,
        "Due": "" if file.due is None else file.due.isoformat(),
        "Status": ", ".join(status_of(file)),
    }
    return {key: words for key, words in entries.items() if words}


def pose_messages(
    detection: PenDetection, tip: StreamedTip | None, number: int, at: float
) -> bytes:
    """Return the messages of a detected pose and its tip position.

    Without a current tip only the pose is sent, with the number of the image and its
    time of exposure, s since 1970 (UTC).
    """
    basic = {"Image": str(number), "Units": "mm rad"}
    sigma = detection.sigma
    if tip is not None:  # the noise is partly known before
        sigma = float(np.fmax(sigma, tip.instrument.sigma))
    covariance = detection.cofactors * sigma**2
    R = detection.rotation
    sent = _transform(
        PEN,
        R,
        detection.translation,
        at,
        {**basic, **_covariance(covariance, "rx ry rz x y z")},
    )
    if tip is None:
        return sent
    place, spread = _place_of_tip(detection, tip.instrument)
    named = {"Pen": tip.names.pen, "Tip": tip.names.tip, **tip.metadata}
    return sent + _transform(
        TIP, R, place, at, {**basic, **named, **_covariance(spread, "x y z")}
    )


def _place_of_tip(
    detection: PenDetection, instrument: Instrument
) -> tuple[FloatArray, FloatArray]:
    """Return the tip in the camera, mm, and its covariance, not of noise alone."""
    pixels = np.full((instrument.rig.n_cameras, *detection.pixels.shape), np.nan)
    pixels[0] = detection.pixels  # of the first camera, whose images are streamed
    frame = ProbingFrame("", pixels, detection.rotation, detection.translation)
    (touch,) = measure_touches(instrument, [StillFrames((frame,))])
    return touch.point_cam, touch.covariance(instrument)


def _covariance(covariance: FloatArray, order: str) -> dict[str, str]:
    """Return the entries of a covariance; none if it is unknown."""
    if not np.isfinite(covariance).all():
        return {}
    numbers = " ".join(f"{value:.9g}" for value in covariance.ravel().tolist())
    return {"Covariance": numbers, "CovarianceOrder": order}


def _transform(
    name: str, R: FloatArray, t: FloatArray, at: float, metadata: Mapping[str, str]
) -> bytes:
    # Not there without the extra "stream", and not needed before a client connects.
    from pyigtl import TransformMessage

    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, t
    message = TransformMessage(matrix, timestamp=at, device_name=name)
    message.header_version = WITH_METADATA
    # WORKAROUND for pyigtl 0.3.4: it fails on texts that are not ASCII.
    message.metadata = {
        key: text.encode("ascii", "backslashreplace").decode()
        for key, text in metadata.items()
    }
    return bytes(message.pack())
