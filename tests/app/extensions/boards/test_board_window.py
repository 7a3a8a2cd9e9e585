"""Calibrating the camera by a board, as an engineer sees it."""

import json
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QSize, Qt, QThreadPool
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QListWidget, QPushButton
from pytestqt.qtbot import QtBot
from tests.simulated_boards import expose_board, render_board, simulate_board_poses

from lightpen.arrays import Image
from lightpen.cameras.protocol import Frame, sealed
from lightpen.detection.spots import detect_spots
from lightpen.formats.camera_files import read_camera
from lightpen.live.pipeline import LiveImage
from lightpen.model.camera import Camera
from lightpen.record.folder import CAMERA_CALIBRATIONS, CalibratedCamera
from lightpen_app.look.figures import pooled
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.boards.view import BoardView
from lightpen_app_extensions.boards.window import BoardWindow
from lightpen_extensions.boards.boards import Board, BoardKind, parse_board
from lightpen_extensions.simulator.scenes import Sensor

if TYPE_CHECKING:
    from tests.app.conftest import HoldBack

BOARD = "chessboard:7x5:20"
CAMERA = Camera(200, 160, 300.0, 299.6, 101.0, 78.0)
SECOND = 1_000_000_000  # ns


@pytest.fixture(scope="module")
def images() -> list[Image]:
    board, rng = parse_board(BOARD), np.random.default_rng(2)
    poses = simulate_board_poses(CAMERA, board, 7, rng)
    return [
        expose_board(render_board(CAMERA, board, R, t), Sensor(), rng)
        for R, t in zip(poses.rotations, poses.translations, strict=True)
    ]


@pytest.fixture
def window(qtbot: QtBot, workbench: Workbench) -> Iterator[BoardWindow]:
    window = BoardWindow(workbench.live, workbench.save_place)
    qtbot.addWidget(window)
    window.board.set_board(parse_board(BOARD))
    window.show()
    yield window
    window.close()


def press(window: BoardWindow, words: str) -> None:
    (button,) = (
        each for each in window.findChildren(QPushButton) if each.text() == words
    )
    assert button.isEnabled(), button.toolTip()
    button.click()


def remark(window: BoardWindow) -> str:
    return window.findChildren(SignLabel)[0].value().text


def views_listed(window: BoardWindow) -> int:
    return window.findChildren(QListWidget)[0].count()


def inside(pixel: np.ndarray) -> list[float]:
    """Return a place in the image that is not on its border, beside numbers."""
    middle = np.array([CAMERA.width, CAMERA.height]) / 2
    place: list[float] = (middle + 0.95 * (pixel - middle) + 2).tolist()
    return place


def written(folder: Path, images: list[Image]) -> str:
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f"{number}.png"), image)
    return str(folder)


@pytest.mark.slow
def test_a_folder_of_images_becomes_a_camera_file_in_use(
    window: BoardWindow, images: list[Image], tmp_path: Path, qtbot: QtBot
) -> None:
    window.read_folder(written(tmp_path, images))
    qtbot.waitUntil(lambda: views_listed(window) == 7)
    path = tmp_path / "camera.yaml"
    with qtbot.waitSignal(window.saved) as saved:
        window.save(path)

    assert saved.args == [str(path)]
    assert read_camera(path).fx == pytest.approx(CAMERA.fx, abs=5)
    overlay = window.findChildren(BoardView)[0].overlay()
    assert overlay.arrows is not None
    assert len(overlay.arrows) == 7 * 35

    press(window, "Uncertainty")
    view = window.findChildren(BoardView)[0]
    uncertainty = view.overlay().uncertainty
    assert view.overlay().arrows is None
    assert uncertainty is not None
    assert view.image_size() == QSize(CAMERA.width, CAMERA.height)
    picture = view.grab().toImage()
    best = np.unravel_index(np.argmin(uncertainty.sigmas), uncertainty.sigmas.shape)
    worst = np.unravel_index(np.argmax(uncertainty.sigmas), uncertainty.sigmas.shape)
    reds = [
        picture.pixelColor(
            view.place_of(*inside(uncertainty.pixels[at])).toPoint()
        ).red()
        for at in (best, worst)
    ]
    assert reds[0] < reds[1]


@pytest.mark.slow
def test_a_view_that_is_left_out_takes_no_part(
    window: BoardWindow, images: list[Image], tmp_path: Path, qtbot: QtBot
) -> None:
    window.read_folder(written(tmp_path, images))
    qtbot.waitUntil(lambda: views_listed(window) == 7)
    window.findChildren(QListWidget)[0].setCurrentRow(0)
    press(window, "Exclude view and recalibrate")

    qtbot.waitUntil(lambda: views_listed(window) == 6)


def test_escape_closes_the_window(window: BoardWindow) -> None:
    window.show()

    QTest.keyClick(window, Qt.Key.Key_Escape)

    assert not window.isVisible()


def test_a_board_that_is_none_is_refused(window: BoardWindow) -> None:
    window.board.set_board(Board(BoardKind.CHESSBOARD, 7, 5, 0.0))
    press(window, "Start")

    assert "lengths" in remark(window)


@pytest.mark.parametrize(
    "name", ["charuco:12x9:20:15:DICT_5X5_100", "asymmetric-circles:4x11:20:10", BOARD]
)
def test_the_fields_tell_the_board(window: BoardWindow, name: str) -> None:
    window.board.set_board(parse_board(name))

    assert window.board.board() == parse_board(name)


@pytest.mark.slow
def test_the_views_of_a_folder_are_counted(
    window: BoardWindow, images: list[Image], tmp_path: Path, qtbot: QtBot
) -> None:
    window.read_folder(written(tmp_path, images))
    qtbot.waitUntil(lambda: views_listed(window) == 7)

    labels = [label.text() for label in window.findChildren(QLabel)]
    assert "Views captured: 7" in labels


def test_images_without_a_board_are_refused_with_the_reason(
    window: BoardWindow, tmp_path: Path, qtbot: QtBot
) -> None:
    window.read_folder(written(tmp_path, [np.full((160, 200), 40, np.uint8)]))

    qtbot.waitUntil(lambda: "None of the 1 images" in remark(window))


@pytest.mark.slow
def test_a_board_held_still_is_kept_by_itself(
    window: BoardWindow, images: list[Image], workbench: Workbench, qtbot: QtBot
) -> None:
    press(window, "Start")
    view = window.findChildren(BoardView)[0]
    count = 0
    for image in images[:2]:
        for _ in range(3):
            count += 1
            shown = _shown(image, count)
            workbench.live.image_shown.emit(shown)
            qtbot.waitUntil(lambda: not window.is_searching)

    overlay = view.overlay()
    assert overlay.outline is not None
    assert "Views captured: 2" in [each.text() for each in window.findChildren(QLabel)]
    assert "View captured." in remark(window)
    press(window, "Stop")


@pytest.mark.slow
def test_another_board_held_before_the_camera_is_named(
    window: BoardWindow, images: list[Image], workbench: Workbench, qtbot: QtBot
) -> None:
    window.board.set_board(parse_board("chessboard:8x6:20"))
    press(window, "Start")
    reported = []
    for count in range(6):  # in 4 s
        workbench.live.image_shown.emit(_shown(images[0], 2 * count))
        qtbot.waitUntil(lambda: not window.is_searching)
        reported.append(remark(window))

    assert "not detected" in reported[0]
    assert "No image shows a chessboard of 8 x 6 inner corners;" in reported[-1]
    press(window, "Stop")


@pytest.mark.slow
def test_a_calibration_in_use_is_kept_with_the_hash_of_each_image(
    window: BoardWindow,
    images: list[Image],
    workbench: Workbench,
    tmp_path: Path,
    qtbot: QtBot,
) -> None:
    reported: list[CalibratedCamera] = []
    window.concluded.connect(reported.append)
    names = workbench.selection.preparation.names
    window.concluded.connect(
        lambda camera: workbench.archive_writer.keep_camera_calibration(camera, names)
    )
    folder = written(tmp_path, images)
    (progress,) = window.findChildren(JobProgress)
    for _ in range(2):  # the first is not used
        window.read_folder(folder)
        qtbot.waitUntil(lambda: not progress.is_running)
        assert views_listed(window) == 7
    with qtbot.waitSignal(window.saved):
        window.save(tmp_path / "camera.yaml")
    window.close()

    (camera,) = reported
    first = sha256((tmp_path / "0.png").read_bytes()).hexdigest()
    assert camera.images["0.png"] == first
    kept = workbench.folder / CAMERA_CALIBRATIONS
    qtbot.waitUntil(lambda: kept.is_dir() and bool(list(kept.glob("*.json"))))
    record = json.loads((kept / "000001.json").read_bytes())
    assert record["camera_file"]["file"] == "camera.yaml"
    assert record["calibration"]["board"] == BOARD
    assert len(record["inputs"]["images"]) == 7


@pytest.fixture
def slow_disk(hold_back: "HoldBack") -> Event:
    """Camera files are saved once this is set."""
    return hold_back("lightpen_app_extensions.boards.view.save_camera")


@pytest.mark.slow
def test_a_camera_file_that_is_still_being_saved_is_kept_though_the_window_is_closed(
    window: BoardWindow,
    images: list[Image],
    tmp_path: Path,
    qtbot: QtBot,
    slow_disk: Event,
) -> None:
    reported: list[CalibratedCamera] = []
    window.concluded.connect(reported.append)
    window.read_folder(written(tmp_path, images))
    qtbot.waitUntil(lambda: views_listed(window) == 7)
    window.save(tmp_path / "camera.yaml")
    window.close()
    assert reported == []
    slow_disk.set()
    qtbot.waitUntil(lambda: reported != [])

    assert len(reported[0].images) == 7


def _shown(image: Image, seconds: int) -> DisplayedImage:
    frame = Frame(sealed(image), seconds, seconds * SECOND)
    height, width = image.shape
    seen = LiveImage(frame, detect_spots(image), None)
    return DisplayedImage(pooled(image, 8), QSize(width, height), seen)


def test_what_the_live_image_shows_is_said_no_more_once_it_is_stopped(
    window: BoardWindow, images: list[Image], workbench: Workbench, qtbot: QtBot
) -> None:
    press(window, "Start")
    workbench.live.image_shown.emit(_shown(images[0], 1))
    qtbot.waitUntil(lambda: not window.is_searching)
    assert remark(window) != ""
    press(window, "Stop")

    assert remark(window) == ""


@pytest.mark.slow
def test_a_window_opened_again_tells_nothing_of_the_calibration_before(
    window: BoardWindow, images: list[Image], tmp_path: Path, qtbot: QtBot
) -> None:
    window.read_folder(written(tmp_path, images))
    qtbot.waitUntil(lambda: views_listed(window) == 7)
    window.close()
    window.show()

    assert (remark(window), views_listed(window)) == ("", 0)
    (save,) = (
        each
        for each in window.findChildren(QPushButton)
        if each.text() == "Save and use..."
    )
    assert not save.isEnabled()


def test_a_calibration_under_way_ends_where_other_views_are_begun(
    window: BoardWindow, images: list[Image], tmp_path: Path
) -> None:
    window.read_folder(written(tmp_path, images))
    press(window, "Start")
    QThreadPool.globalInstance().waitForDone()
    QApplication.processEvents()

    assert (remark(window), views_listed(window)) == ("", 0)
    press(window, "Stop")


@pytest.mark.slow
def test_a_calibration_that_is_cancelled_leaves_the_one_before(
    window: BoardWindow,
    images: list[Image],
    tmp_path: Path,
    qtbot: QtBot,
    hold_back: "HoldBack",
) -> None:
    reported: list[CalibratedCamera] = []
    window.concluded.connect(reported.append)
    folder = written(tmp_path, images)
    window.read_folder(folder)
    qtbot.waitUntil(lambda: views_listed(window) == 7)
    before = remark(window)
    may_begin = hold_back("lightpen_app_extensions.boards.view.find_images")
    (progress,) = window.findChildren(JobProgress)
    assert not progress.isVisible()

    window.read_folder(folder)
    assert progress.isVisible()
    press(window, "Cancel")
    may_begin.set()
    QThreadPool.globalInstance().waitForDone()
    QApplication.processEvents()

    assert not progress.isVisible()
    assert (remark(window), views_listed(window)) == (before, 7)
    assert reported == []
