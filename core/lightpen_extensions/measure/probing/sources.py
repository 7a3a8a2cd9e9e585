"""From files to touches: the calibration that is verified, and the images of a run."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations, observe_images
from lightpen.detection.pen_detection import PenDetection, detect_from_centers, unseen
from lightpen.detection.reasons import counted
from lightpen.detection.rig_observations import observe_rig_images
from lightpen.errors import CalibrationError, FileError, UsageError
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.calibration_record import InstrumentRecord
from lightpen.estimation.uncertainty.instrument import Instrument, PenScale
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import sha256
from lightpen.formats.images import ImageSource, find_images
from lightpen.formats.observation_files import pair_images
from lightpen.formats.opened_files import InputFile, all_hashed
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.messages import Message, message, printable
from lightpen.model.bending import ASSUMED_BENDING, Bending
from lightpen.model.camera import Camera
from lightpen.model.limits import Assumptions
from lightpen.model.names import Origin
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of
from lightpen.record.calibrations import CalibrationFile
from lightpen.record.swings.reading import (
    Record,
    RecordedImage,
    image_name,
    is_record,
    open_record,
)
from lightpen.record.swings.solving import RecordSource, is_simulated_recording, source
from lightpen_extensions.measure.probing.instruments import (
    in_use,
    instrument_of_files,
    see_together,
    with_rig,
)
from lightpen_extensions.measure.probing.probing import (
    ProbingRules,
    take_all,
    touch_frame,
)
from lightpen_extensions.measure.tasks.probed_point import (
    ProbedPoint,
    ProbingFrame,
    RejectedFrame,
    StillFrames,
    measure_touches,
)

# Locations of images of touches: folders, patterns, videos and records of swings.
#
# Those of a rig are in a folder for each camera, named as the rig file names it, in the
# folder of a run; or in a record.


@dataclass(frozen=True, eq=False)
class PenCameras:
    """The cameras that observe the pen, one or a rig."""

    rig: Rig
    files: tuple[InputFile, ...]  # of the camera; or of the rig and all its cameras

    @property
    def hashes(self) -> tuple[str, ...]:
        """SHA-256 of their files, which identify them."""
        return tuple(file.sha256 for file in self.files)


@dataclass(frozen=True, eq=False)
class ImageLocation:
    """Images of touches, and the files that they bring if they are a record's."""

    name: str
    images: tuple[ImageSource, ...]
    origin: Origin | None
    viewers: PenCameras | None = None
    pen: Pen | None = None
    pen_file: Path | None = None
    masks: tuple[FloatArray | None, ...] = (None,)  # (M, 3), stray light, px
    held: tuple[tuple[int, StillFrames], ...] = ()  # points of a record, with runs
    operator: str = ""  # who took images of a record, and in what environment
    conditions: Assumptions | None = None

    def of_bits(self, bits: int | None) -> "ImageLocation":
        """Return the place with images of so many bits; see `ImageSource.of_bits`."""
        return replace(self, images=tuple(each.of_bits(bits) for each in self.images))

    @property
    def files(self) -> tuple[Path, ...]:
        """Files of all images."""
        return tuple(file for each in self.images for file in each.files)


def viewers_of_camera(camera: Camera, file: Path) -> PenCameras:
    """Return a single camera that was read from a file."""
    return PenCameras(rig_of(camera), all_hashed([file]))


def viewers_of_rig(file: RigFile) -> PenCameras:
    """Return the cameras of a rig file."""
    return PenCameras(file.rig, all_hashed([file.path, *file.camera_files]))


def read_viewers(camera_file: Path | None, rig_file: Path | None) -> PenCameras | None:
    """Read a camera file or a rig file; None for any other file."""
    if rig_file is not None:
        return viewers_of_rig(read_rig(rig_file))
    if camera_file is not None:
        return viewers_of_camera(read_camera(camera_file), camera_file)
    return None


def touch_place(where: tuple[str, ...], rig: Rig | None = None) -> ImageLocation:
    """Return a place as `lightpen.formats.images.find_images` takes it, or a record.

    With a rig, it lists one place per camera, or is a folder with one sub-folder each.
    """
    folder = Path(where[0])
    if len(where) == 1 and is_record(folder):
        record = open_record(folder)
        own = source(record)
        return ImageLocation(
            name=where[0],
            images=own.images,
            origin=record.header.origin,
            viewers=_recorded_viewers(own),
            pen=own.pen,
            pen_file=own.pen_file,
            masks=own.masks,
            held=held_in(record),
            operator=record.header.names.operator,
            conditions=record.header.assumptions,
        )
    is_simulated = is_simulated_recording(where[0])
    origin = Origin.SIMULATED if is_simulated else Origin.RECORDED
    if rig is None or rig.n_cameras == 1:
        return ImageLocation(where[0], (find_images(*where),), origin)
    images = tuple(map(find_images, _of_each_camera(where, rig)))
    return ImageLocation(where[0], images, origin, masks=(None,) * rig.n_cameras)


def held_in(record: Record) -> tuple[tuple[int, StillFrames], ...]:
    """Return the run of each point in a record, and the point by its LED centres."""
    by_point: dict[int, list[RecordedImage]] = {}
    for image in record.used_images:
        if image.touch:
            by_point.setdefault(image.touch, []).append(image)
    return tuple(
        (own[0].run, StillFrames(tuple(map(_frame, own)), (), _approach(own[0])))
        for own in by_point.values()
    )


def _approach(image: RecordedImage) -> FloatArray | None:
    return None if image.approach is None else np.array(image.approach)


def _frame(image: RecordedImage) -> ProbingFrame:
    return ProbingFrame(
        point_image_name(image.number),
        image.rig_pixels,
        np.array(image.rotation),
        np.array(image.translation),
    )


def point_image_name(number: int) -> str:
    """Return the name of an image in the record of a session, from 1."""
    return Path(image_name(number)).name


def _recorded_viewers(own: RecordSource) -> PenCameras:
    if own.rig_file is None:
        return viewers_of_camera(own.camera, own.camera_files[0])
    return PenCameras(own.rig, all_hashed([own.rig_file, *own.camera_files]))


def _of_each_camera(where: tuple[str, ...], rig: Rig) -> tuple[str, ...]:
    """Return the places of the images of each camera."""
    if len(where) == rig.n_cameras:
        return where
    folders = [Path(where[0]) / name for name in rig.names]
    if len(where) > 1 or not all(map(Path.is_dir, folders)):
        raise FileError(
            "verification.no-rig-folders",
            place=printable(where[0]),
            names=", ".join(rig.names),
        )
    return tuple(map(str, folders))


MAX_RMS = 1.0  # px; LED errors of 0.3 mm make this


@dataclass(frozen=True, eq=False)
class ProbingRun:
    """The touches of one run, and images that belong to none."""

    name: str
    touches: tuple[ProbedPoint, ...]
    rejected: tuple[RejectedFrame, ...]


def instrument_of(
    calibration: CalibrationFile,
    viewers: PenCameras,
    pen: Pen,
    pen_file: Path,
    temperature_c: float | None = None,
    bending: Bending = ASSUMED_BENDING,
) -> Instrument:
    """Return the instrument of a calibration of the same pen, as it measures.

    With other cameras than in the calibration, tip and LEDs are taken from the swing
    and the cameras from their files. ``temperature_c`` is that of the pen while it
    measures, None if not known.
    """
    assumed = calibration.calibration.assumptions
    conditions = replace(assumed, temperature_c=temperature_c)
    found = _calibrated_instrument(calibration, viewers, pen, pen_file)
    return in_use(found, pen, conditions, bending)


def _calibrated_instrument(
    calibration: CalibrationFile, viewers: PenCameras, pen: Pen, pen_file: Path
) -> Instrument:
    """Return the instrument as adjusted by a calibration of the same pen."""
    record = calibration.calibration
    if sha256(pen_file) != calibration.pen_sha256 or pen.n_leds != len(record.leds):
        raise UsageError(
            "verification.another-pen",
            tip=calibration.path,
            its_pen=printable(record.inputs.pen.file),
            pen=pen_file,
        )
    if record.method != "joint":
        return instrument_of_files(
            viewers.rig,
            pen,
            calibration.tip_pen,
            np.array(record.covariance)[:3, :3],
            record.sigma_px,
        )
    fitted = record.instrument
    instrument = Instrument(
        rig=_fitted_rig(viewers, fitted),
        pen=replace(
            pen, leds=np.array(fitted.leds_mm), diameter=fitted.disc_diameter_mm
        ),
        tip_pen=calibration.tip_pen,
        covariance=np.array(fitted.covariance),
        sigma=record.sigma_px,
        scale=PenScale(
            growth=fitted.scale.growth,
            file_sigma=fitted.scale.file_sigma,
            thermal_sigma=fitted.scale.thermal_sigma,
            deviation=fitted.scale.deviation,
            variance=fitted.scale.variance,
            covariance=np.array(fitted.scale.covariance),
        ),
    )
    is_same = viewers.hashes == calibration.camera_hashes
    return instrument if is_same else with_rig(instrument, viewers.rig)


def _fitted_rig(viewers: PenCameras, fitted: InstrumentRecord) -> Rig:
    """Return the cameras as adjusted by a swing."""
    one = viewers.rig.cameras[0]  # whose images are as large
    of_files = dict(enumerate(viewers.rig.cameras))
    others = fitted.other_cameras
    intrinsics = [fitted.intrinsics, *(other.intrinsics for other in others)]
    return replace(
        viewers.rig,
        cameras=tuple(
            of_files.get(c, one).with_intrinsics(np.array(each))
            for c, each in enumerate(intrinsics)
        ),
        rotations=np.array([np.eye(3), *(o.cam_from_rig_rotation for o in others)]),
        translations=np.array(
            [np.zeros(3), *(o.cam_from_rig_translation_mm for o in others)]
        ),
        covariance=None,
    )


def require_cameras(place: ImageLocation, rig: Rig) -> None:
    """Reject a place of more cameras, or fewer, than a rig has."""
    if len(place.images) != rig.n_cameras:
        raise UsageError(
            "verification.other-number-of-cameras",
            place=printable(place.name),
            n_given=len(place.images),
            n_cameras=rig.n_cameras,
        )


def recorded_runs(place: ImageLocation, instrument: Instrument) -> list[ProbingRun]:
    """Return the points in a record of a session, run by run."""
    require_cameras(place, instrument.rig)
    runs = []
    for number in sorted({run for run, _ in place.held}):
        own = [still for run, still in place.held if run == number]
        touches = measure_touches(instrument, own)
        require_leds_fit(place.name, touches)
        runs.append(ProbingRun(place.name, touches, ()))
    return runs


def observe_place(
    place: ImageLocation, instrument: Instrument
) -> tuple[Observations, ...]:
    """Find and label the LEDs in the images of each camera."""
    rig, pen = instrument.rig, instrument.pen
    require_cameras(place, rig)
    if rig.n_cameras == 1:
        images, mask = place.images[0], place.masks[0]
        return (observe_images(images, instrument.camera, pen, mask=mask),)
    pairing = pair_images([each.names for each in place.images], rig.names)
    return observe_rig_images(place.images, pairing, rig, pen, masks=place.masks)


def touches_of(
    name: str, seen: Sequence[Observations], instrument: Instrument, rules: ProbingRules
) -> ProbingRun:
    """Return the touches in the observations of each camera.

    With one image a touch, and none to settle, each image is a touch; else the pen must
    be held still through as many as the rules say. Raises `CalibrationError` if no
    image shows the pen, or the LEDs are of another pen.
    """
    images = _detections(seen, instrument)
    if not any(detection.has_pose for _, detection in images):
        raise _no_pen(name, seen[0])
    held = _held(images, instrument, rules)
    if not held:
        raise CalibrationError(
            "verification.never-still",
            run=name,
            n_all=rules.n_settling + rules.n_frames,
            n_settling=rules.n_settling,
            n_frames=rules.n_frames,
        )
    touches = measure_touches(instrument, held)
    require_leds_fit(name, touches)
    named = {each.name for touch in touches for each in touch.rejected}
    rejected = tuple(
        RejectedFrame(image, detection.reason)
        for image, detection in images
        if not detection.has_pose and image not in named
    )
    return ProbingRun(name, touches, rejected)


def require_leds_fit(name: str, touches: Sequence[ProbedPoint]) -> None:
    """Reject touches with a median residual that is too large for this pen."""
    rms = float(np.median([touch.rms for touch in touches]))
    if rms > MAX_RMS:
        raise CalibrationError(
            "verification.leds-do-not-fit", run=name, rms=rms, usual=USUAL_SIGMA
        )


def _held(
    images: Sequence[tuple[str, PenDetection]],
    instrument: Instrument,
    rules: ProbingRules,
) -> tuple[StillFrames, ...]:
    if rules.n_frames + rules.n_settling > 1:
        return take_all(instrument, rules, images).taken
    return tuple(
        StillFrames((touch_frame(name, detection),))
        for name, detection in images
        if detection.has_pose
    )


def _detections(
    seen: Sequence[Observations], instrument: Instrument
) -> list[tuple[str, PenDetection]]:
    """Return name and sighting of each moment, by all cameras together."""
    rig, pen = instrument.rig, instrument.pen
    images = []
    for i, name in enumerate(seen[0].names):
        views = [
            _detection(rig.cameras[c], pen, each, i) for c, each in enumerate(seen)
        ]
        detection = replace(views[0], others=tuple(views[1:]))
        name = name or next(each.names[i] for each in seen if each.names[i])
        images.append((name, see_together(rig, pen, detection)))
    return images


def _detection(camera: Camera, pen: Pen, seen: Observations, i: int) -> PenDetection:
    if seen.reasons[i]:
        return unseen(pen, seen.reasons[i])
    return detect_from_centers(
        camera, pen, seen.pixels[i], seen.rotations[i], seen.translations[i]
    )


def _no_pen(name: str, seen: Observations) -> CalibrationError:
    why: tuple[Message, ...] = tuple(
        counted(n_images, reason) for reason, n_images in Counter(seen.reasons).items()
    )
    advice = seen.advice or message("verification.show-pen")
    return CalibrationError(
        "verification.no-pen",
        run=name,
        n_images=len(seen.names),
        why=why,
        advice=advice,
    )
