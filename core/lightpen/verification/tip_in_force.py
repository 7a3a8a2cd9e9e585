"""The tip in force of a station, and the instrument that it makes with its files."""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.aim import Aim
from lightpen.errors import UsageError
from lightpen.estimation.instrument import Instrument
from lightpen.formats.files import printable
from lightpen.formats.hashes import InputFile, hashed
from lightpen.model.origin import Origin
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.record.folder_archive import FolderArchive
from lightpen.record.names import Names
from lightpen.sentences import sentence
from lightpen.swing.preparation import Preparation
from lightpen.verification.places import TouchPlace
from lightpen.verification.sources import instrument_of


@dataclass(frozen=True, eq=False)
class TipInForce:
    """A tip that was accepted, with the files that it is verified by.

    Attributes
    ----------
    names : Names
        Of what is chosen now.
    origin : Origin
        What the images of its verification are of.
    nominal_tip, cone_cam : (3,) array or None
        mm; the cone of the calibration is not known before another camera.
    mask : (M, 3) array
        Circles of stray light: centre x, y and radius, px.
    """

    names: Names
    origin: Origin
    calibration: CalibrationFile
    instrument: Instrument
    nominal_tip: FloatArray | None
    cone_cam: FloatArray | None
    mask: FloatArray
    tip_file: InputFile
    camera_file: InputFile
    pen_file: InputFile

    @property
    def aim(self) -> Aim:
        """What to look for in the images."""
        return Aim(self.instrument.camera, self.instrument.pen, self.mask)

    def is_like(self, other: "TipInForce") -> bool:
        """Return whether touches with the other tip are touches with this one."""
        return (
            self.names == other.names
            and self.origin is other.origin
            and self.tip_file == other.tip_file
            and self.camera_file == other.camera_file
            and self.pen_file == other.pen_file
            and np.array_equal(self.mask, other.mask)
        )


def read_tip_in_force(archive: FolderArchive, preparation: Preparation) -> TipInForce:
    """Return the tip in force of the pen and tip that are chosen.

    Parameters
    ----------
    preparation : Preparation
        With names and both files.

    Raises
    ------
    LightpenError
        There is none, its result was changed, or it is of another LED file.
    """
    names, origin = preparation.names, preparation.origin
    if preparation.second is not None:
        raise UsageError(
            sentence(
                "verification.two-cameras",
                "Two cameras look at the pen, and a tip is verified by one. Choose a "
                "single camera with its intrinsics file.",
            )
        )
    camera_file, pen_file = preparation.camera_file, preparation.pen_file
    if camera_file is None or pen_file is None:
        raise ValueError("`camera_file` and `pen_file` must be chosen.")
    file = archive.file_in_force(
        names.pen, names.tip, is_simulated=origin is Origin.SIMULATED
    )
    if file is None:
        raise UsageError(
            sentence(
                "verification.no-tip",
                "No tip is in force for tip {tip} of pen {pen}. Calibrate it and "
                "accept the result; then it can be verified.",
                tip=printable(names.tip),
                pen=printable(names.pen),
            )
        )
    calibration = read_calibration(file)
    instrument = instrument_of(
        *(calibration, camera_file.camera, camera_file.path),
        *(pen_file.pen, pen_file.path),
    )
    nominal_tip = preparation.nominal_tip
    for known in (pen_file.pen.nominal_tip, calibration.nominal_tip):
        nominal_tip = known if nominal_tip is None else nominal_tip
    camera = hashed(camera_file.path)
    return TipInForce(
        names=names,
        origin=origin,
        calibration=calibration,
        instrument=instrument,
        nominal_tip=nominal_tip,
        cone_cam=_cone_cam(calibration, camera),
        mask=preparation.mask,
        tip_file=hashed(file),
        camera_file=camera,
        pen_file=hashed(pen_file.path),
    )


def tip_at(tip: TipInForce, place: TouchPlace) -> TipInForce:
    """Return a tip before the camera of recorded images, if they bring one.

    Raises
    ------
    UsageError
        They are of another pen.
    """
    camera, pen, pen_file = place.camera, place.pen, place.pen_file
    if camera is None or place.camera_file is None or pen is None or pen_file is None:
        return tip
    calibration, camera_file = tip.calibration, hashed(place.camera_file)
    return replace(
        tip,
        instrument=instrument_of(calibration, camera, place.camera_file, pen, pen_file),
        cone_cam=_cone_cam(calibration, camera_file),
        camera_file=camera_file,
        pen_file=hashed(pen_file),
    )


def _cone_cam(calibration: CalibrationFile, camera: InputFile) -> FloatArray | None:
    """Return where the calibration had the cone, before the same camera."""
    is_same = camera.sha256 == calibration.camera_sha256
    return calibration.cone_cam if is_same else None
