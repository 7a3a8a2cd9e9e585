"""A tip in force that no images were needed for, and what is seen of it touching."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.detection.pen_detection import PenDetection, detect_from_centers, unseen
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration, calibrate_rig
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.camera_files import read_camera
from lightpen.formats.observation_files import Centers
from lightpen.formats.opened_files import Inputs, RigInputs, with_content
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import read_rig
from lightpen.model.names import Origin
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of, rotations_of
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.swing.preparation import Preparation
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    perturbed_pen,
    swing_poses,
)

N_IMAGES = 40
SIGMA = 0.01  # px
ACCEPTED = datetime(2031, 4, 30, 12, tzinfo=UTC)


def accept_tip(
    data: Path,
    preparation: Preparation,
    seed: int = 3,
    led_error: float = 0.0,
    grade: Grade = Grade.PASS,
) -> Path:
    """Put a tip in force by a simulated swing; return the file of its result.

    Parameters
    ----------
    led_error : float
        Standard deviation of the LEDs off their places in the file, mm; in each swing
        of the pen the same.
    """
    pen, rig_file = preparation.pen_file, preparation.rig_file
    assert pen is not None
    origin = preparation.origin
    if rig_file is None:
        assert preparation.camera_file is not None
        camera_file, rig_inputs = preparation.camera_file.path, None
    else:
        camera_file = rig_file.camera_files[0]
        files = tuple(map(with_content, rig_file.camera_files))
        rig_inputs = RigInputs(with_content(rig_file.path), files)
    found = _calibrated(
        *(camera_file, pen.path, seed, led_error),
        None if rig_file is None else rig_file.path,
    )
    inputs = Inputs(
        *(with_content(camera_file), with_content(pen.path), ()),
        preparation.nominal_tip,
        origin=origin,
        rig=rig_inputs,
    )
    archive, names = FolderArchive(data), preparation.names
    archive.store(
        Result(
            names=names,
            accepted=ACCEPTED,
            grade=grade,
            record=data / "records" / "swing",
            images=(),
            calibration=calibration_record(found, inputs, preparation.limits),
            origin=origin,
        )
    )
    file = archive.file_in_force(
        names.pen, names.tip, is_simulated=origin is Origin.SIMULATED
    )
    assert file is not None
    return file


@cache
def _calibrated(
    camera_file: Path,
    pen_file: Path,
    seed: int,
    led_error: float,
    rig_file: Path | None,
) -> Calibration:
    rig = (
        rig_of(read_camera(camera_file)) if rig_file is None else read_rig(rig_file).rig
    )
    pen, rng = read_pen(pen_file), np.random.default_rng(seed)
    true_pen = perturbed_pen(pen, led_error, np.random.default_rng(9))
    swing = swing_poses(N_IMAGES, rng, pen=true_pen, camera=rig.cameras[0])
    pixels = seen_by(rig, true_pen, swing.rotations, swing.translations, rng)
    seen = [
        observe_centers(
            Centers(np.arange(1, N_IMAGES + 1), each, Path("swing.csv")), camera, pen
        )
        for each, camera in zip(pixels, rig.cameras, strict=True)
    ]
    return calibrate_rig(rig, pen, seen)


def seen_by(
    rig: Rig,
    pen: Pen,
    rotations: FloatArray,
    translations: FloatArray,
    rng: np.random.Generator,
    sigma: float = SIGMA,
) -> list[FloatArray]:
    """Return LED centres (N, L, 2) in each camera of poses rig_from_pen, px."""
    return [
        simulate_centers(camera, pen, R @ rotations, translations @ R.T + t, sigma, rng)
        for camera, R, t in zip(
            rig.cameras, rig.rotations, rig.translations, strict=True
        )
    ]


@dataclass(frozen=True, eq=False)
class Hold:
    """A tip held at a place from the bottom of the cone, mm, leant so, rad."""

    place: Sequence[float] = (0.0, 0.0, 0.0)
    tilt: float = 0.3
    direction: float = 0.0


class Holder:
    """Shows the pen as it is held, without an image.

    Parameters
    ----------
    tip_pen : (3,) array
        Where the tip really is, mm.
    """

    def __init__(self, rig: Rig, pen: Pen, tip_pen: FloatArray = PAPER_TIP) -> None:
        self.rig, self.pen, self._tip_pen = rig, pen, tip_pen
        self._rng = np.random.default_rng(7)

    def still(self, hold: Hold, n_images: int = 10) -> Iterator[PenDetection]:
        """Yield what is seen of a pen that is held still."""
        R = rotations_of(
            *(self.pen, np.array([hold.tilt])),
            *(np.array([hold.direction]), np.zeros(1)),
        )
        t = PAPER_CONE + np.array(hold.place) - R @ self._tip_pen
        for _ in range(n_images):
            pixels = seen_by(self.rig, self.pen, R, t, self._rng)
            first, *others = (
                detect_from_centers(
                    camera, self.pen, seen, turn @ R[0], turn @ t[0] + shift
                )
                for camera, (seen,), turn, shift in zip(
                    *(self.rig.cameras, pixels),
                    *(self.rig.rotations, self.rig.translations),
                    strict=True,
                )
            )
            yield replace(first, others=tuple(others))

    def away(self, n_images: int = 8) -> Iterator[PenDetection]:
        """Yield what is seen while the pen is out of the image."""
        for _ in range(n_images):
            yield unseen(self.pen, Reason.EMPTY)


def leant(n: int, place: Sequence[float] = (0.0, 0.0, 0.0)) -> list[Hold]:
    """Return n postures at one place, each leant another way."""
    return [Hold(place, direction=2 * np.pi * i / n) for i in range(n)]


def round_a_ring(n: int, radius: float, degrees: float = 360.0) -> list[Hold]:
    """Return n places on a ring above the cone."""
    angles = np.radians(degrees) * np.arange(n) / n
    return [Hold((radius * np.cos(a), -40.0 + radius * np.sin(a), 0.0)) for a in angles]
