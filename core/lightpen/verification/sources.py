"""From files to touches: the calibration that is verified, and the images of a run."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.detection.observations import Observations, observe_images
from lightpen.detection.reasons import counted
from lightpen.detection.rig_observations import observe_rig_images
from lightpen.detection.rig_pose import see_together
from lightpen.detection.sighting import Sighting, sight_centers, unseen
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.instrument import (
    Instrument,
    instrument_of_files,
    with_rig,
)
from lightpen.estimation.single_images import USUAL_SIGMA
from lightpen.formats.files import printable, sha256
from lightpen.formats.pairing import pair_images
from lightpen.model.camera import Camera
from lightpen.model.limits import VerificationLimits
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.record.calibrations import CalibrationFile, FittedInstrument
from lightpen.sentences import Sentence, sentence
from lightpen.verification.places import TouchPlace, Viewers
from lightpen.verification.touch import (
    RejectedFrame,
    StillFrames,
    Touch,
    measure_touches,
)
from lightpen.verification.touching import TouchRules, take_all, touch_frame
from lightpen.verification.witness import LampWatch, LampWitness, lamps_in

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
    lamps : LampWatch
        What the images show of fixed lamps.
    """

    name: str
    touches: tuple[Touch, ...]
    rejected: tuple[RejectedFrame, ...]
    lamps: LampWatch


def witness_of(
    runs: Sequence[TouchRun], instrument: Instrument, limits: VerificationLimits
) -> LampWitness | None:
    """Return what fixed lamps tell of the camera by runs in the order of time."""
    lamps = LampWatch()
    for run in runs:
        lamps = lamps.then(run.lamps)
    return lamps.witness(instrument.rig.cameras, limits)


def instrument_of(
    calibration: CalibrationFile, viewers: Viewers, pen: Pen, pen_file: Path
) -> Instrument:
    """Return the instrument that a calibration left.

    Before other cameras than those of the calibration, tip and LEDs are as the swing
    left them and the cameras are as their files have them.

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
    is_whole = fitted is not None and calibration.is_of_rig == bool(fitted.others)
    if fitted is None or not is_whole or calibration.method != "joint":
        return instrument_of_files(
            viewers.rig,
            pen,
            calibration.tip_pen,
            calibration.covariance[:3, :3],
            calibration.sigma,
        )
    instrument = Instrument(
        rig=_fitted_rig(viewers, fitted),
        pen=replace(pen, leds=fitted.leds, diameter=fitted.diameter),
        tip_pen=calibration.tip_pen,
        covariance=fitted.covariance,
        sigma=calibration.sigma,
    )
    is_same = viewers.hashes == calibration.seen_by
    return instrument if is_same else with_rig(instrument, viewers.rig)


def _fitted_rig(viewers: Viewers, fitted: FittedInstrument) -> Rig:
    """Return the cameras as a swing left them."""
    one = viewers.rig.cameras[0]  # whose images are as large
    of_files = dict(enumerate(viewers.rig.cameras))
    intrinsics = [fitted.intrinsics, *(other.intrinsics for other in fitted.others)]
    return replace(
        viewers.rig,
        cameras=tuple(
            of_files.get(c, one).with_intrinsics(each)
            for c, each in enumerate(intrinsics)
        ),
        rotations=np.array([np.eye(3), *(other.rotation for other in fitted.others)]),
        translations=np.array(
            [np.zeros(3), *(other.translation for other in fitted.others)]
        ),
        covariance=None,
    )


def touch_run(place: TouchPlace, instrument: Instrument, rules: TouchRules) -> TouchRun:
    """Find the touches in images.

    With one image a touch, and none to settle, each image is a touch; else the pen must
    be held still through as many as the rules say. Images of which it is recorded what
    touch they are of need no rules.

    Raises
    ------
    FileError
        No image can be read, or those of two cameras are of other moments.
    CalibrationError
        No image shows the pen, or its LEDs are not those of the pen.
    """
    seen = observe_place(place, instrument)
    return touches_of(place.name, seen, instrument, rules, place.touches)


def observe_place(
    place: TouchPlace, instrument: Instrument
) -> tuple[Observations, ...]:
    """Find and label the LEDs in the images of each camera.

    Raises
    ------
    FileError, CalibrationError
        As of `touch_run`.
    """
    rig, pen = instrument.rig, instrument.pen
    if len(place.images) != rig.n_cameras:
        raise _other_number(place, rig)
    if rig.n_cameras == 1:
        images, mask = place.images[0], place.masks[0]
        return (observe_images(images, instrument.camera, pen, mask=mask),)
    pairing = pair_images([each.names for each in place.images], rig.names)
    return observe_rig_images(place.images, pairing, rig, pen, masks=place.masks)


def touches_of(
    name: str,
    seen: Sequence[Observations],
    instrument: Instrument,
    rules: TouchRules,
    touches_known: Sequence[int] | None = None,
) -> TouchRun:
    """Return the touches in what the images of each camera show; see `touch_run`."""
    images = _sightings(seen, instrument)
    if not any(sighting.has_pose for _, sighting in images):
        raise _no_pen(name, seen[0])
    if touches_known is None:
        held = _held(images, instrument, rules)
    else:
        held = _held_as_recorded(images, touches_known)
    if not held:
        raise CalibrationError(
            sentence(
                "verification.never-still",
                "{run}: the pen was held still nowhere for {n_all} images, "
                "{n_settling} to settle and {n_frames} that count. Hold it still "
                "longer on each point, ask for fewer images of a touch, or take each "
                "image for a touch.",
                run=name,
                n_all=rules.n_settling + rules.n_frames,
                n_settling=rules.n_settling,
                n_frames=rules.n_frames,
            )
        )
    touches = measure_touches(instrument, held)
    require_leds_fit(name, touches)
    named = {each.name for touch in touches for each in touch.rejected}
    rejected = tuple(
        RejectedFrame(image, sighting.reason)
        for image, sighting in images
        if not sighting.has_pose and image not in named
    )
    return TouchRun(name, touches, rejected, lamps_in(seen))


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
    images: Sequence[tuple[str, Sighting]], instrument: Instrument, rules: TouchRules
) -> tuple[StillFrames, ...]:
    if rules.n_frames + rules.n_settling > 1:
        return take_all(instrument, rules, images).taken
    return tuple(
        StillFrames((touch_frame(name, sighting),))
        for name, sighting in images
        if sighting.has_pose
    )


def _held_as_recorded(
    images: Sequence[tuple[str, Sighting]], touches: Sequence[int]
) -> tuple[StillFrames, ...]:
    """Return the images of each touch; 0 of those that are of none."""
    by_touch: dict[int, list[tuple[str, Sighting]]] = {}
    for image, touch in zip(images, touches, strict=True):
        if touch:
            by_touch.setdefault(touch, []).append(image)
    held = (
        StillFrames(
            tuple(touch_frame(*image) for image in own if image[1].has_pose),
            tuple(
                RejectedFrame(name, seen.reason)
                for name, seen in own
                if not seen.has_pose
            ),
        )
        for own in by_touch.values()
    )
    return tuple(still for still in held if still.frames)


def _sightings(
    seen: Sequence[Observations], instrument: Instrument
) -> list[tuple[str, Sighting]]:
    """Return name and sighting of each moment, by all cameras together."""
    rig, pen = instrument.rig, instrument.pen
    images = []
    for i, name in enumerate(seen[0].names):
        views = [_sighting(rig.cameras[c], pen, each, i) for c, each in enumerate(seen)]
        sighting = replace(views[0], others=tuple(views[1:]))
        name = name or next(each.names[i] for each in seen if each.names[i])
        images.append((name, see_together(rig, pen, sighting)))
    return images


def _sighting(camera: Camera, pen: Pen, seen: Observations, i: int) -> Sighting:
    if seen.reasons[i]:
        return unseen(pen, seen.reasons[i])
    return sight_centers(
        camera, pen, seen.pixels[i], seen.rotations[i], seen.translations[i]
    )


def _other_number(place: TouchPlace, rig: Rig) -> UsageError:
    return UsageError(
        sentence(
            "verification.other-number-of-cameras",
            "{place} holds the images of {n_given} cameras, and the tip is verified "
            "by {n_cameras}. Give the camera file, or the rig file, of these images.",
            place=printable(place.name),
            n_given=len(place.images),
            n_cameras=rig.n_cameras,
        )
    )


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
