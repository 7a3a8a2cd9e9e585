"""What is chosen at a station is in force at once, and there again the next time."""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QThreadPool
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from lightpen.cameras.protocol import CameraSettings, Connection
from lightpen.formats.decoding import encode_png
from lightpen.formats.opened_files import PenFile
from lightpen.model.limits import USUAL, SwingLimits, with_focal_length
from lightpen.model.names import Origin
from lightpen.record.results.result_folder import SIMULATED
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import (
    NO_SOURCE,
    MissingInput,
    Preparation,
    SourceChoice,
    SourceKind,
)
from lightpen.swing.status import SwingStatus
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.work.settings import FilePaths, Settings, StoredCamera
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.simulator import SceneSimulator

OTHER = Names("Hall 3", "Bo", "LP-05", "T-11", "C-2", 6.0)
MASK = np.array([[101.25, 0.1, 12.0], [1e-3, 700.0, 1 / 3]])


class Stage:
    """A workbench that can be left and taken up again, as by another start."""

    def __init__(
        self, settings: Settings, folder: Path, workbench: Workbench, qtbot: QtBot
    ) -> None:
        self.settings, self.folder, self.workbench = settings, folder, workbench
        self.qtbot = qtbot
        self.sentences: list[str] = []
        self.applied: list[CameraSettings] = []  # since it was started again

    def choose(self, **choices: object) -> None:
        """Choose something in place of what is chosen."""
        self.workbench.selection.set_preparation(
            replace(self.workbench.selection.preparation, **choices)  # type: ignore[arg-type]
        )

    def start_again(self) -> Preparation:
        """Start the program anew and return what is chosen then."""
        self.workbench.shut_down()
        again = Settings(self.settings.file)
        self.workbench = Workbench(again, self.folder, self.workbench.around)
        self.listen()
        self.applied.clear()
        self.workbench.live.settings_applied.connect(self.applied.append)
        self.workbench.start()
        self.wait_for_files()
        return self.workbench.selection.preparation

    def listen(self) -> None:
        """Write down what is to be read."""
        self.workbench.notifications.raised.connect(
            lambda text, _: self.sentences.append(text)
        )

    def choose_station(self, name: str) -> None:
        """Take over what was chosen last at a station, its files, too."""
        self.workbench.selection.choose_station(name)
        self.wait_for_files()

    def wait_for_files(self) -> None:
        self.qtbot.waitUntil(lambda: not self.workbench.files.is_reading)

    def wait_for_size(self, size: tuple[int, int]) -> None:
        self.qtbot.waitUntil(
            lambda: self.workbench.selection.preparation.image_size == size
        )


@pytest.fixture
def stage(
    settings: Settings, tmp_path: Path, workbench: Workbench, qtbot: QtBot
) -> Iterator[Stage]:
    stage = Stage(settings, tmp_path / "data", workbench, qtbot)
    stage.listen()
    yield stage
    stage.workbench.shut_down()


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A folder with an image of 80 x 60 px."""
    folder = tmp_path / "recorded, on a Monday"
    folder.mkdir()
    image = np.zeros((60, 80), np.uint8)
    (folder / "1.png").write_bytes(encode_png(image))
    return folder


# What is remembered


def test_everything_that_was_chosen_is_chosen_at_the_next_start(stage: Stage) -> None:
    before = stage.workbench.selection.preparation
    assumed = replace(with_focal_length(USUAL, 0.001), temperature_c=23.5, warmth=4.0)
    stage.choose(
        nominal_tip=np.array([0.1, -90.0, 1 / 3]),
        mask=MASK,
        limits=SwingLimits(max_uncertainty=0.007, min_images=11, max_images=99),
        assumptions=assumed,
    )
    now = stage.start_again()

    assert now.names == before.names
    assert now.source == before.source
    assert now.nominal_tip is not None
    assert now.nominal_tip.tolist() == [0.1, -90.0, 1 / 3]
    np.testing.assert_array_equal(now.mask, MASK)
    assert now.limits == SwingLimits(0.007, 11, 99)
    assert now.assumptions == assumed
    assert now.camera_file is not None
    assert before.camera_file is not None
    assert now.camera_file.path == before.camera_file.path
    assert now.pen_file is not None
    assert before.pen_file is not None
    assert now.pen_file.path == before.pen_file.path
    assert now.start_missing_inputs() == now.leds_missing_inputs() == ()
    assert stage.sentences == []


def test_the_units_of_a_pen_file_that_does_not_say_are_remembered(
    stage: Stage, tmp_path: Path
) -> None:
    pen = stage.workbench.selection.preparation.pen
    assert pen is not None
    path = tmp_path / "leds.csv"
    rows = [f"{i + 1},{x},{y},{z}" for i, (x, y, z) in enumerate(pen.leds / 10)]
    path.write_text("\n".join(["led,x,y,z", *rows]))
    stage.choose(pen_file=PenFile.read(path, "cm"))
    now = stage.start_again()

    assert now.pen_file is not None
    assert now.pen_file.units == "cm"
    assert now.pen is not None
    np.testing.assert_allclose(now.pen.leds, pen.leds, atol=1e-9)


def test_each_station_has_choices_of_its_own(stage: Stage) -> None:
    first = stage.workbench.selection.preparation
    stage.choose(names=OTHER, mask=MASK)
    stage.choose_station(first.names.station)
    assert stage.workbench.selection.preparation.names == first.names
    assert len(stage.workbench.selection.preparation.mask) == 0

    stage.choose_station(OTHER.station)
    assert stage.workbench.selection.preparation.names == OTHER
    np.testing.assert_array_equal(stage.workbench.selection.preparation.mask, MASK)
    assert set(stage.workbench.selection.stations()) == {
        first.names.station,
        OTHER.station,
    }
    assert stage.start_again().names == OTHER


def test_without_a_station_nothing_is_remembered(stage: Stage) -> None:
    stage.choose(names=replace(OTHER, station=""))

    assert stage.workbench.selection.stations() == ("Hall 2",)


def test_a_first_start_has_no_source_until_one_is_chosen(
    tmp_path: Path, workbench: Workbench, qtbot: QtBot
) -> None:
    settings = Settings(tmp_path / "new" / "lightpen.json")
    first = Workbench(settings, tmp_path / "new data", workbench.around)
    first.start()
    qtbot.waitUntil(lambda: not first.files.is_reading)
    assert first.selection.preparation.camera_missing_inputs() == (
        MissingInput.SOURCE,
        MissingInput.CAMERA_FILE,
    )
    assert first.selection.preparation.origin is Origin.LIVE
    first.selection.set_preparation(
        first.selection.preparation.with_source(SourceChoice())
    )
    first.files.use_samples()
    first.camera.open()
    qtbot.waitUntil(lambda: not first.files.is_reading)
    now = first.selection.preparation

    assert (now.names.pen, now.names.tip, now.names.cone) == ("", "", "C-1")
    assert now.names.station
    assert now.camera is not None
    assert (now.camera.width, now.camera.height) == (1224, 1024)
    assert now.leds_missing_inputs() == ()
    assert (tmp_path / "new data" / SIMULATED).is_dir()
    qtbot.waitUntil(lambda: first.selection.preparation.camera_missing_inputs() == ())
    first.shut_down()


# Files


def test_a_file_that_cannot_be_read_is_reported_and_must_be_chosen_again(
    stage: Stage,
) -> None:
    pen_file = stage.workbench.selection.preparation.pen_file
    assert pen_file is not None
    pen_file.path.write_text("led 1 is here")
    now = stage.start_again()

    assert now.pen_file is None
    assert now.camera_file is not None
    assert now.leds_missing_inputs() == (MissingInput.PEN_FILE,)
    assert len(stage.sentences) == 1
    assert "pen.json" in stage.sentences[0]


@pytest.mark.parametrize(
    "read",
    [
        lambda workbench: workbench.files.use_samples(),
        lambda workbench: workbench.selection.choose_station("Hall 2"),
    ],
    ids=["sample files", "files of the station"],
)
def test_files_of_the_simulated_pen_that_come_late_are_not_those_of_another_source(
    stage: Stage, recording: Path, read: Callable[[Workbench], None]
) -> None:
    read(stage.workbench)
    source = SourceChoice(SourceKind.RECORDED, str(recording))
    stage.workbench.selection.set_preparation(
        stage.workbench.selection.preparation.with_source(source)
    )
    stage.wait_for_files()

    now = stage.workbench.selection.preparation
    assert (now.camera_file, now.pen_file) == (None, None)


def test_sample_files_that_cannot_be_written_are_reported(
    tmp_path: Path, workbench: Workbench, qtbot: QtBot
) -> None:
    (tmp_path / "a file").write_text("")
    settings = Settings(tmp_path / "new.ini")
    first = Workbench(settings, tmp_path / "a file", workbench.around)
    sentences: list[str] = []
    first.notifications.raised.connect(lambda text, _: sentences.append(text))
    first.start()
    first.files.use_samples()
    qtbot.waitUntil(lambda: not first.files.is_reading)
    first.shut_down()

    assert first.selection.preparation.camera_file is None
    assert "a file" in sentences[0]


@pytest.mark.parametrize(
    "entries",
    [
        {"camera": {"source": {"kind": "a camera of a later version"}}},
        {"camera": {"mask": [[1, 2]]}},
        {"camera": {"mask": "1 2 3"}},
        {"nominal_tip": [1, 2]},
        {"files": {"camera": "", "pen": ""}},
        {"limits": {"min_images": -5, "max_images": 0}},
        {"limits": {"max_uncertainty": -1.0}},
        {"assumptions": {"warmth": -1.0}},
    ],
)
def test_settings_that_make_no_sense_are_passed_over(
    stage: Stage, entries: dict[str, object]
) -> None:
    assert stage.settings.await_saved(120.0)
    content = json.loads(stage.settings.file.read_text())
    content["stations"] = {"Hall 4": entries}
    stage.settings.file.write_text(json.dumps(content))
    stage.start_again()
    stage.choose_station("Hall 4")
    now = stage.workbench.selection.preparation

    assert now.source == NO_SOURCE
    assert now.limits == SwingLimits()
    assert now.assumptions == USUAL
    assert now.mask.shape == (0, 3)
    assert now.nominal_tip is None
    assert (now.camera_file, now.pen_file) == (None, None)


# The camera


def test_the_size_of_the_images_is_known_as_soon_as_they_come(stage: Stage) -> None:
    assert stage.workbench.selection.preparation.camera_missing_inputs() == (
        MissingInput.IMAGES,
    )
    stage.workbench.camera.open()
    stage.wait_for_size((1224, 1024))

    assert stage.workbench.selection.preparation.missing_inputs() == ()


def test_choosing_before_the_start_opens_no_camera(
    stage: Stage, recording: Path
) -> None:
    stage.choose(source=SourceChoice(SourceKind.RECORDED, str(recording)))

    assert not stage.workbench.live.is_open


def test_another_source_is_opened_at_once(stage: Stage, recording: Path) -> None:
    stage.workbench.camera.open()
    stage.wait_for_size((1224, 1024))
    stage.choose(source=SourceChoice(SourceKind.RECORDED, str(recording)))
    assert stage.workbench.selection.preparation.image_size is None
    stage.wait_for_size((80, 60))
    assert stage.workbench.selection.preparation.camera_missing_inputs() == (
        MissingInput.IMAGE_SIZE,
    )

    stage.choose(source=SourceChoice())
    stage.wait_for_size((1224, 1024))
    assert stage.workbench.selection.preparation.camera_missing_inputs() == ()


def test_a_recording_is_opened_when_its_place_is_named(
    stage: Stage, recording: Path
) -> None:
    stage.workbench.camera.open()
    stage.choose(source=SourceChoice(SourceKind.RECORDED))
    assert not stage.workbench.live.is_open
    assert stage.workbench.selection.preparation.camera_missing_inputs() == (
        MissingInput.SOURCE_PLACE,
    )
    stage.choose(source=SourceChoice(SourceKind.RECORDED, str(recording)))

    stage.wait_for_size((80, 60))


def test_the_same_source_stays_open(stage: Stage) -> None:
    stage.workbench.camera.open()
    stage.wait_for_size((1224, 1024))
    before = stage.workbench.live.stats.delivered
    stage.choose(names=OTHER, mask=MASK)

    assert stage.workbench.live.connection is Connection.STREAMING
    assert stage.workbench.live.stats.delivered >= before > 0
    assert stage.workbench.selection.preparation.image_size == (1224, 1024)


def test_a_source_that_is_not_there_is_reported_and_can_be_tried_again(
    stage: Stage, recording: Path
) -> None:
    moved = recording.rename(recording.with_name("moved"))
    stage.workbench.camera.open()
    stage.choose(source=SourceChoice(SourceKind.RECORDED, str(recording)))
    stage.qtbot.waitUntil(lambda: len(stage.sentences) == 1)
    assert "There is no folder, video or image at" in stage.sentences[0]
    moved.rename(recording)
    stage.workbench.camera.open()

    stage.wait_for_size((80, 60))


def test_what_is_chosen_is_looked_for_in_the_images(stage: Stage) -> None:
    stage.workbench.camera.open()
    with stage.qtbot.waitSignal(
        stage.workbench.live.image_shown,
        check_params_cb=lambda shown: shown.seen.detection is not None,
    ):
        pass
    stage.choose(pen_file=None)
    with stage.qtbot.waitSignal(
        stage.workbench.live.image_shown,
        check_params_cb=lambda shown: shown.seen.detection is None,
    ):
        pass


def test_settings_come_back_with_their_camera(stage: Stage) -> None:
    stage.workbench.camera.open()
    set_camera(stage, 500.0, 6.0)
    stage.choose(names=OTHER)
    stage.choose_station("Hall 2")
    stage.start_again()
    stage.qtbot.waitUntil(
        lambda: any((s.exposure_us, s.gain_db) == (500.0, 6.0) for s in stage.applied)
    )


def set_camera(stage: Stage, exposure_us: float, gain_db: float) -> None:
    with stage.qtbot.waitSignal(
        stage.workbench.live.settings_applied,
        check_params_cb=lambda s: (s.exposure_us, s.gain_db) == (exposure_us, gain_db),
    ):
        stage.workbench.live.set_exposure(exposure_us)
        stage.workbench.live.set_gain(gain_db)


def test_a_recording_does_not_forget_the_exposure(
    stage: Stage, recording: Path
) -> None:
    stage.workbench.camera.open()
    set_camera(stage, 500.0, 6.0)
    stage.choose(source=SourceChoice(SourceKind.RECORDED, str(recording)))
    stage.wait_for_size((80, 60))
    with stage.qtbot.waitSignal(
        stage.workbench.live.settings_applied,
        check_params_cb=lambda s: (s.exposure_us, s.gain_db) == (500.0, 6.0),
    ):
        stage.choose(source=SourceChoice())


# Results and records


def test_shutting_down_twice_does_no_harm(stage: Stage) -> None:
    stage.workbench.camera.open()
    stage.workbench.shut_down()
    stage.workbench.shut_down()

    assert not stage.workbench.live.is_open


def test_what_is_reported_after_shutting_down_begins_nothing(stage: Stage) -> None:
    from lightpen_app_extensions.stream.service import StreamService
    from lightpen_extensions.stream.server import StreamPlace

    workbench = stage.workbench
    stream = StreamService(workbench)
    stream.streaming.want(StreamPlace(port=0))  # a job that tells of its end later
    workbench.library.refresh()
    workbench.shut_down()
    reported: list[str] = []
    workbench.run.changed.connect(lambda: reported.append("swing"))
    workbench.library.changed.connect(lambda: reported.append("library"))
    workbench.run.post(SwingStatus(), ())
    workbench.library.refresh()
    for _ in range(3):
        QCoreApplication.processEvents()
        assert QThreadPool.globalInstance().waitForDone(0)

    assert reported == []


def test_a_new_station_keeps_no_file_that_was_being_read_for_another(
    stage: Stage,
) -> None:
    stage.choose(names=OTHER)
    stage.workbench.selection.choose_station(OTHER.station)  # its files are being read
    stage.workbench.selection.choose_station("")
    stage.choose(names=replace(OTHER, station="Hall 9"))
    stage.wait_for_files()

    kept = stage.settings.station("Hall 9")
    assert (kept.files.camera, kept.files.pen) == ("", "")


def test_why_a_rig_file_cannot_be_read_is_taken_back_with_the_second_camera(
    stage: Stage, qtbot: QtBot
) -> None:
    stage.choose(names=OTHER)
    lost = str(stage.folder / "lost.json")
    there = stage.settings.station(OTHER.station)
    stage.settings.set_station(
        OTHER.station,
        replace(there, second=StoredCamera(SourceChoice()), files=FilePaths(rig=lost)),
    )
    stage.choose_station(OTHER.station)
    (reported,) = (each for each in stage.sentences if "lost.json" in each)
    found = SceneSimulator().write_files(stage.folder / "rig").rig_file
    assert found is not None
    with qtbot.waitSignal(stage.workbench.notifications.withdrawn) as withdrawn:
        stage.workbench.selection.set_preparation(
            stage.workbench.selection.preparation.with_rig(found)
        )

    assert withdrawn.args == [reported]


def test_what_could_not_be_saved_is_taken_back_in_the_language_it_was_reported_in(
    stage: Stage, qapp: QApplication, qtbot: QtBot
) -> None:
    assert stage.settings.await_saved(120.0)
    config = stage.settings.file.parent
    shutil.rmtree(config)
    config.write_text("not a folder")
    stage.choose(names=OTHER)
    stage.qtbot.waitUntil(lambda: bool(stage.sentences))
    LanguageSwitch(qapp).set_language("zh_CN")
    config.unlink()

    with qtbot.waitSignal(stage.workbench.notifications.withdrawn) as withdrawn:
        stage.choose(names=replace(OTHER, operator="Eve"))

    assert withdrawn.args == stage.sentences
