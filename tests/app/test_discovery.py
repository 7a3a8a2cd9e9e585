"""Finding pen and camera without files, from the button to the swing of the tip."""

from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from tests.simulated_stations import random_station

from lightpen.cameras.protocol import Frame, sealed
from lightpen.detection.spots import EXACT_SIGMA, Spots
from lightpen.formats.decoding import read_image
from lightpen.live.pipeline import LiveImage, Sink
from lightpen.record.swings.recordings import files_beside
from lightpen.swing.preparation import SourceKind
from lightpen_app.discovery.discovery_run import DISCOVERIES, FIRST_TRIAL
from lightpen_app.discovery.discovery_window import DiscoveryWindow
from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.pen_view import PenView
from lightpen_app.widgets.posture_dial import PostureDial
from lightpen_app.work.workbench import Workbench

N_IMAGES = 80
STATION = random_station(6, n_images=N_IMAGES)
SHARE = 0.25  # of the image size; the pictures themselves are not looked at
BLACK = sealed(
    np.zeros(
        (round(SHARE * STATION.camera.height), round(SHARE * STATION.camera.width)),
        np.uint8,
    )
)


def shown(number: int) -> LiveImage:
    """Return an image of the station's swing with its spots."""
    centers = SHARE * STATION.sightings.centers[number]
    n, ones = len(centers), np.ones(len(centers))
    spots = Spots(
        centers=centers,
        shapes=np.tile(np.eye(2), (n, 1, 1)),
        areas=np.nan * ones,
        contrasts=ones,
        edge_widths=ones,
        flaws=np.zeros(n, np.int64),
        sigmas=EXACT_SIGMA * ones,
    )
    frame = Frame(image=BLACK, seq=number, host_ts_ns=number * 50_000_000)
    return LiveImage(frame, spots, None)


@pytest.fixture
def sinks(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> list[Sink | None]:
    """Return who was given the images; no camera is open."""
    given: list[Sink | None] = [None]
    monkeypatch.setattr(workbench.live, "set_sink", given.append)
    return given


def take(sink: Sink, numbers: range) -> None:
    """Give images to a sink on a thread of their own, as the pipeline does."""

    def run() -> None:
        for number in numbers:
            sink(shown(number))

    thread = Thread(target=run)
    thread.start()
    thread.join()


def press(window: DiscoveryWindow, words: str) -> None:
    (button,) = (
        each for each in window.findChildren(QPushButton) if each.text() == words
    )
    assert button.isEnabled(), button.toolTip()
    button.click()


def test_a_swing_and_a_length_become_both_files_and_the_source_of_the_next_swing(
    workbench: Workbench, sinks: list[Sink | None], qtbot: QtBot
) -> None:
    window = DiscoveryWindow(workbench)
    qtbot.addWidget(window)
    window.show()
    press(window, "Start")
    qtbot.waitUntil(lambda: sinks[-1] is not None)
    sink = sinks[-1]
    assert sink is not None
    take(sink, range(FIRST_TRIAL))
    (pen,), (dial,) = window.findChildren(PenView), window.findChildren(PostureDial)
    qtbot.waitUntil(pen.isVisible)  # by the images so far
    assert len(pen.value().marked) == 2
    assert dial.value().counts.sum() > 0.5 * FIRST_TRIAL
    take(sink, range(FIRST_TRIAL, N_IMAGES))
    press(window, "Stop")
    assert sinks[-1] is None

    length, *_ = window.findChildren(NumberField)
    length.setValue(STATION.longest)
    press(window, "Find pen and camera")
    save = "Save both files and calibrate the tip"
    button = next(b for b in window.findChildren(QPushButton) if b.text() == save)
    qtbot.waitUntil(button.isEnabled)
    assert not dial.isVisible()
    press(window, save)
    qtbot.waitUntil(
        lambda: workbench.selection.preparation.source.kind == SourceKind.RECORDED
    )

    now = workbench.selection.preparation
    assert now.camera_file is not None
    assert now.pen_file is not None
    assert now.camera_file.camera.fx == pytest.approx(
        SHARE * STATION.camera.fx, rel=0.01
    )
    assert now.pen_file.pen.n_leds == STATION.pen.n_leds
    images = Path(now.source.place)
    assert images.is_relative_to(workbench.folder / DISCOVERIES)
    assert len(list(images.iterdir())) == N_IMAGES
    assert read_image(images / "000001.png").shape == BLACK.shape
    beside = files_beside(now.source.place)
    assert (beside.camera, beside.pen) == (now.camera_file.path, now.pen_file.path)


def test_both_panels_without_a_file_ask_for_the_swing(qtbot: QtBot) -> None:
    for panel in (IntrinsicsPanel(), LedFilePanel()):
        qtbot.addWidget(panel)
        button = next(
            each
            for each in panel.findChildren(QPushButton)
            if each.text() == "I have no such file..."
        )
        with qtbot.waitSignal(panel.discovery_requested, timeout=1000):
            button.click()
