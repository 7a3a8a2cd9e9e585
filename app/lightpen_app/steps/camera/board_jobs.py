"""What the window for a board has done off the thread of the GUI."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from lightpen.arrays import FloatArray, Image
from lightpen.formats.camera_files import write_camera
from lightpen.formats.hashes import InputFile, all_hashed, hashed
from lightpen.formats.images import find_images
from lightpen.intrinsics.boards import Board
from lightpen.intrinsics.calibration import (
    CameraCalibration,
    calibrate_camera,
)
from lightpen.intrinsics.capture import Capture, wanted_outline
from lightpen.intrinsics.observing import observe_board, why_unseen
from lightpen.intrinsics.sightings import find_points
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.local_time import local_now
from lightpen.model.camera import Camera
from lightpen.sentences import Sentence
from lightpen_app.work.job import Report


@dataclass(frozen=True, eq=False)
class BoardLook:
    """What one image shows, and the hash of its pixels where that is the board."""

    points: FloatArray | None
    sha256: str = ""
    why_unseen: Sentence | None = None


@dataclass(frozen=True, eq=False)
class ComputedCamera:
    """A calibration, and the hash of each image by its name."""

    found: CameraCalibration
    hashes: dict[str, str]


@dataclass(frozen=True, eq=False)
class WantedOutline:
    """Where the board should be held next, as its outline in the image, (4, 2), px."""

    outline: FloatArray


def look_for_board(
    image: Image, board: Board, asks_why: bool, report: Report
) -> BoardLook:
    """Return what an image shows of a board, and why nothing if it is asked."""
    points = find_points(image, board, quick=True)
    if points is None:
        return BoardLook(
            None, why_unseen=why_unseen(lambda: [image], board) if asks_why else None
        )
    return BoardLook(points, sha256(image.tobytes()).hexdigest())


def find_outline(capture: Capture, report: Report) -> WantedOutline:
    """Return where the board should be held next."""
    return WantedOutline(wanted_outline(capture))


def calibrate_by_views(
    views: Views, hashes: dict[str, str], report: Report
) -> ComputedCamera:
    """Calibrate the camera by views that were kept."""
    found = calibrate_camera(views, BoardTolerances(), local_now().date(), report)
    return ComputedCamera(found, hashes)


def calibrate_by_folder(folder: str, board: Board, report: Report) -> ComputedCamera:
    """Calibrate the camera by images in a folder.

    Raises
    ------
    FileError, CalibrationError
        There are no images, or they do not tell the camera.
    """
    images = find_images(folder)
    observed = observe_board(images, board, lambda fraction: report(0.7 * fraction))
    found = calibrate_camera(
        observed.views,
        BoardTolerances(),
        local_now().date(),
        lambda fraction: report(0.7 + 0.3 * fraction),
    )
    files = all_hashed(images.files)
    return ComputedCamera(found, {file.path.name: file.sha256 for file in files})


def save_camera(camera: Camera, path: Path, report: Report) -> InputFile:
    """Write a camera file, and return it with its hash.

    Raises
    ------
    FileError
        It cannot be written.
    """
    write_camera(camera, path)
    return hashed(path)
