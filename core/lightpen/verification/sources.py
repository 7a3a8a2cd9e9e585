"""From files to touches: the calibration that is verified, and the images of a run."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations, observe_images
from lightpen.detection.reasons import counted
from lightpen.detection.sighting import Sighting, sight_centers, unseen
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.instrument import (
    Instrument,
    instrument_of_files,
    with_camera,
)
from lightpen.estimation.single_images import USUAL_SIGMA
from lightpen.formats.files import printable, sha256
from lightpen.formats.images import ImageSource
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.record.calibrations import CalibrationFile
from lightpen.sentences import Sentence, sentence
from lightpen.verification.touch import (
    RejectedFrame,
    StillFrames,
    Touch,
    TouchFrame,
    measure_touches,
)
from lightpen.verification.touching import TouchRules, take_all

MAX_RMS = 1.0  # px; LED errors of 0.3 mm make this


@dataclass(frozen=True, eq=False)
class TouchRun:
    """The touches of one run.

    Attributes
    ----------
    name : str
        Of its folder or file.
    rejected : tuple of RejectedFrame
        Images that belong to no touch, and why.
    """

    name: str
    touches: tuple[Touch, ...]
    rejected: tuple[RejectedFrame, ...]


def instrument_of(
    calibration: CalibrationFile,
    camera: Camera,
    camera_file: Path,
    pen: Pen,
    pen_file: Path,
) -> Instrument:
    """Return the instrument that a calibration left.

    Before another camera than that of the calibration, tip and LEDs are as the swing
    left them and the camera is as its file has it.

    Raises
    ------
    UsageError
        The calibration is of another pen.
    """
    if sha256(pen_file) != calibration.pen_sha256 or pen.n_leds != calibration.n_leds:
        raise UsageError(
            sentence(
                "verification.another-pen",
                "The tip in {tip} was calibrated with the pen file {its_pen}, which "
                "{pen} is not: a tip belongs to the pen, and to the LED positions, "
                "that it was calibrated with. Give that file, or calibrate the tip "
                "with this one.",
                tip=printable(str(calibration.path)),
                its_pen=printable(calibration.pen_file),
                pen=printable(str(pen_file)),
            )
        )
    fitted = calibration.instrument
    if fitted is None or calibration.method != "joint":
        return instrument_of_files(
            camera,
            pen,
            calibration.tip_pen,
            calibration.covariance[:3, :3],
            calibration.sigma,
        )
    same_camera = sha256(camera_file) == calibration.camera_sha256 and len(
        camera.intrinsics
    ) == len(fitted.intrinsics)
    instrument = Instrument(
        camera=camera.with_intrinsics(fitted.intrinsics),
        pen=replace(pen, leds=fitted.leds, diameter=fitted.diameter),
        tip_pen=calibration.tip_pen,
        covariance=fitted.covariance,
        sigma=calibration.sigma,
    )
    return instrument if same_camera else with_camera(instrument, camera)


def touch_run(
    name: str,
    images: ImageSource,
    instrument: Instrument,
    rules: TouchRules,
    mask: FloatArray | None = None,
) -> TouchRun:
    """Find the touches in images.

    With one image a touch, and none to settle, each image is a touch; else the pen must
    be held still through as many as the rules say.

    Raises
    ------
    FileError
        No image can be read.
    CalibrationError
        No image shows the pen, or its LEDs are not those of the pen.
    """
    seen = observe_images(images, instrument.camera, instrument.pen, mask=mask)
    return touches_of(name, seen, instrument, rules)


def touches_of(
    name: str, seen: Observations, instrument: Instrument, rules: TouchRules
) -> TouchRun:
    """Return the touches in what images show; see `touch_run`."""
    fit = [i for i, reason in enumerate(seen.reasons) if not reason]
    if not fit:
        raise _no_pen(name, seen)
    held = _held(seen, fit, instrument, rules)
    if not held:
        raise CalibrationError(
            sentence(
                "verification.never-still",
                "{run}: the pen was held still nowhere for {n_frames} images. Hold it "
                "still on each point, or take each image for a touch.",
                run=name,
                n_frames=rules.n_settling + rules.n_frames,
            )
        )
    touches = measure_touches(instrument, held)
    require_leds_fit(name, touches)
    named = {each.name for touch in touches for each in touch.rejected}
    rejected = tuple(
        RejectedFrame(image, reason)
        for image, reason in zip(seen.names, seen.reasons, strict=True)
        if reason and image not in named
    )
    return TouchRun(name, touches, rejected)


def require_leds_fit(name: str, touches: Sequence[Touch]) -> None:
    """Refuse touches whose images are not of the LEDs of the pen.

    Raises
    ------
    CalibrationError
    """
    rms = float(np.median([touch.rms for touch in touches]))
    if rms > MAX_RMS:
        raise CalibrationError(
            sentence(
                "verification.leds-do-not-fit",
                "{run}: the LED positions do not fit the images: {rms:.1f} px, {usual} "
                "px or less is usual. Check that the images are of this pen and this "
                "camera.",
                run=name,
                rms=rms,
                usual=USUAL_SIGMA,
            )
        )


def _held(
    seen: Observations, fit: list[int], instrument: Instrument, rules: TouchRules
) -> tuple[StillFrames, ...]:
    if rules.n_frames + rules.n_settling == 1:
        return tuple(
            StillFrames(
                (
                    TouchFrame(
                        seen.names[i],
                        seen.pixels[i],
                        seen.rotations[i],
                        seen.translations[i],
                    ),
                )
            )
            for i in fit
        )
    images = zip(seen.names, _sightings(seen, instrument), strict=True)
    return take_all(instrument, rules, images).taken


def _sightings(seen: Observations, instrument: Instrument) -> list[Sighting]:
    camera, pen = instrument.camera, instrument.pen
    return [
        unseen(pen, reason)
        if reason
        else sight_centers(camera, pen, pixels, rotation, translation)
        for reason, pixels, rotation, translation in zip(
            seen.reasons, seen.pixels, seen.rotations, seen.translations, strict=True
        )
    ]


def _no_pen(name: str, seen: Observations) -> CalibrationError:
    why: tuple[Sentence, ...] = tuple(
        counted(n_images, reason) for reason, n_images in Counter(seen.reasons).items()
    )
    advice = seen.advice or sentence(
        "verification.show-pen", "Show the camera the pen that the tip belongs to."
    )
    return CalibrationError(
        sentence(
            "verification.no-pen",
            "{run}: none of the {n_images} images shows the pen ({why}). {advice}",
            run=name,
            n_images=len(seen.names),
            why=why,
            advice=advice,
        )
    )
