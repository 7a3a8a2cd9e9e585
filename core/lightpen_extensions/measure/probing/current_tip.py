"""The current tip of a station, and the instrument that it makes with its files."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.errors import UsageError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.opened_files import InputFile, hashed
from lightpen.local_time import local_now
from lightpen.messages import printable
from lightpen.model.bending import ASSUMED_BENDING, Bending
from lightpen.model.names import Origin
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.record.library.tip_library import read_library
from lightpen.record.results.result_folder import FolderArchive, data_folder_of
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.probing.sources import (
    PenCameras,
    instrument_of,
    viewers_of_camera,
    viewers_of_rig,
)


@dataclass(frozen=True, eq=False)
class CurrentTip:
    """A tip that was accepted, with the files that it is verified by."""

    names: Names
    origin: Origin
    calibration: CalibrationFile
    instrument: Instrument
    nominal_tip: FloatArray | None  # (3,), mm
    masks: tuple[FloatArray, ...]  # (M, 3), stray light: x, y, radius, px
    viewers: PenCameras
    tip_file: InputFile
    pen_file: InputFile
    temperature_c: float | None = None  # of the pen on that day
    humidity_percent: float | None = None  # of the room on that day

    @property
    def region(self) -> RegionOfInterest:
        """Target of the detection."""
        pen, rig = self.instrument.pen, self.instrument.rig
        first, *others = (
            RegionOfInterest(camera, pen, mask)
            for camera, mask in zip(rig.cameras, self.masks, strict=True)
        )
        return replace(first, others=tuple(others))

    def is_like(self, other: "CurrentTip") -> bool:
        """Return whether points probed with the other tip are valid for this one."""
        return (
            self.names == other.names
            and self.origin is other.origin
            and self.tip_file == other.tip_file
            and self.viewers.hashes == other.viewers.hashes
            and self.pen_file == other.pen_file
            and all(map(np.array_equal, self.masks, other.masks))
        )


def read_tip_in_force(archive: FolderArchive, preparation: Preparation) -> CurrentTip:
    """Return the current tip of the pen and tip that are chosen, with both files.

    Raises `LightpenError` if there is none, its result was changed, or it is of another
    LED file.
    """
    names, origin = preparation.names, preparation.origin
    pen_file = preparation.pen_file
    viewers = _viewers(preparation)
    if viewers is None or pen_file is None:
        raise ValueError("Cameras and `pen_file` must be chosen.")
    file = archive.file_in_force(
        names.pen, names.tip, is_simulated=origin is Origin.SIMULATED
    )
    if file is None:
        raise UsageError(
            "verification.no-tip", tip=printable(names.tip), pen=printable(names.pen)
        )
    calibration = read_calibration(file)
    today = preparation.assumptions_today
    instrument = instrument_of(
        *(calibration, viewers, pen_file.pen, pen_file.path),
        *(today.temperature_c, bending_of(calibration)),
    )
    nominal_tip = preparation.nominal_tip
    for known in (pen_file.pen.nominal_tip, calibration.nominal_tip):
        nominal_tip = known if nominal_tip is None else nominal_tip
    return CurrentTip(
        names=names,
        origin=origin,
        calibration=calibration,
        instrument=instrument,
        nominal_tip=nominal_tip,
        masks=tuple(map(preparation.mask_of, range(viewers.rig.n_cameras))),
        viewers=viewers,
        tip_file=hashed(file),
        pen_file=hashed(pen_file.path),
        temperature_c=today.temperature_c,
        humidity_percent=today.humidity_percent,
    )


def _viewers(preparation: Preparation) -> PenCameras | None:
    """Return the cameras that are chosen."""
    rig_file, camera_file = preparation.rig_file, preparation.camera_file
    if preparation.second is not None:
        return None if rig_file is None else viewers_of_rig(rig_file)
    if camera_file is None:
        return None
    return viewers_of_camera(camera_file.camera, camera_file.path)


def bending_of(calibration: CalibrationFile, data: Path | None = None) -> Bending:
    """Return the bending of a tip today.

    By the library of a data folder, by default that of the result. The library knows
    no simulated tip.
    """
    data = data or data_folder_of(calibration.path)
    if data is None or calibration.origin is Origin.SIMULATED:
        return ASSUMED_BENDING
    return read_library(data).bending_of(calibration.names.tip, local_now().date())
