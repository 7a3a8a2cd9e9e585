"""The step Camera as an operator sees it: live image, exposure, intrinsics, masks."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QFileDialog,
    QLabel,
    QLineEdit,
    QPushButton,
    QWidget,
)
from pytestqt.qtbot import QtBot
from tests.app.blank_page import BlankPage
from tests.app.undressed import undressed
from tests.faulty_camera import FaultyCamera
from tests.simulated_lights import Lamp

from lightpen.cameras.pairing import not_synchronised
from lightpen.cameras.protocol import CameraSettings, Connection, Frame, sealed
from lightpen.cameras.source import FoundDevice
from lightpen.detection.inspection import SEARCHED_IMAGES
from lightpen.detection.spots import detect_spots
from lightpen.formats.rig_files import write_camera
from lightpen.live.pipeline import LiveImage
from lightpen.live.sources import Operator
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import Tone
from lightpen_app.shell.main_window import MainWindow
from lightpen_app.steps.camera.exposure_panel import ExposurePanel, FocusPanel
from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel, PartDialog
from lightpen_app.steps.camera.live_panel import LivePanel
from lightpen_app.steps.camera.page import CameraPage
from lightpen_app.steps.camera.rig_panel import RigPanel
from lightpen_app.steps.camera.source_panel import SourcePanel
from lightpen_app.steps.camera.stray_light_panel import StrayLightPanel
from lightpen_app.widgets.image_view import Marker
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.work.settings import Preferences, Settings
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.hand import HandActivity, SimulatedOperator
from lightpen_extensions.simulator.scene_files import write_scene
from lightpen_extensions.simulator.scenes import Scene

if TYPE_CHECKING:
    from tests.app.steps.conftest import See, Seen

N_LEDS = 10
LAMPS = (
    Lamp(np.array([200.0, 150.0]), (8.0, 6.0)),
    Lamp(np.array([1050.0, 760.0]), (5.0, 5.0)),
)


def numbers(seen: "Seen") -> set[str]:
    """Return those of the LEDs that are marked."""
    return {marker.label for marker in seen.markers if marker.tone is Tone.GOOD}


def others(seen: "Seen") -> list[Marker]:
    return [marker for marker in seen.markers if marker.tone is Tone.WARN]


def crossed(seen: "Seen") -> list[Marker]:
    return [marker for marker in seen.markers if marker.crossed]


def exposure(seen: "Seen") -> str:
    return seen.child(ExposurePanel).verdict().text


@pytest.fixture
def page(qtbot: QtBot, workbench: Workbench) -> Iterator[CameraPage]:
    with undressed():
        page = CameraPage(workbench, Sounds(Path()))
    qtbot.addWidget(page)
    page.resize(976, 600)
    page.show()
    yield page
    page.shut_down()


@pytest.fixture
def seen(page: CameraPage, see: "See") -> "Seen":
    return see(page)


@pytest.fixture
def live(seen: "Seen") -> "Seen":
    """The page with live images of the simulated pen."""
    seen.page.entered()
    seen.wait("10 of 10 LEDs")
    return seen


def plugged(workbench: Workbench, scene: Scene, *lamps: Lamp) -> FaultyCamera:
    """Open a simulated camera in which things can go wrong."""
    clock = workbench.around.clock
    camera = FaultyCamera(scene, clock, others=lamps)
    workbench.live.open([camera], CameraSettings(), clock)
    return camera


def operator_of(workbench: Workbench) -> Operator:
    """Return the simulated operator in view."""
    operator = workbench.live.operator
    assert operator is not None
    return operator


def recording(
    folder: Path, n_images: int = 2, size: tuple[int, int] = (80, 64)
) -> Path:
    """Write a folder of images without any LED."""
    folder.mkdir()
    for i in range(n_images):
        image = np.zeros(size[::-1], np.uint8)
        (folder / f"frame_{i}.png").write_bytes(
            cv2.imencode(".png", image)[1].tobytes()
        )
    return folder


def intrinsics(workbench: Workbench, folder: Path, **changes: object) -> Path:
    """Write a file like the one in use, with changes."""
    camera = workbench.selection.preparation.camera
    assert camera is not None
    path = folder / "other.yaml"
    write_camera(replace(camera, **changes), path)  # type: ignore[arg-type]
    return path


# Two cameras


def places(seen: "Seen") -> dict[str, float]:
    """Return where the LEDs are marked, px from the left."""
    return {marker.label: marker.x for marker in seen.markers}


def are_apart(one: Mapping[str, float], other: Mapping[str, float]) -> bool:
    """Whether LEDs are seen elsewhere by the other camera, if not those midway."""
    return any(abs(other[label] - x) > 5 for label, x in one.items())


def ask_for_second(seen: "Seen") -> None:
    (box,) = (
        each
        for each in seen.page.findChildren(QCheckBox)
        if each.text().startswith("Use a second camera")
    )
    box.click()


@pytest.mark.slow
def test_a_second_camera_is_shown_set_and_masked_by_itself(
    live: "Seen", workbench: Workbench
) -> None:
    assert workbench.selection.preparation.second is None
    ask_for_second(live)
    live.wait("Baseline 500.00")
    live.until(lambda: len(places(live)) == N_LEDS)
    first = places(live)
    live.click("Camera 2")
    with live.qtbot.waitSignal(
        workbench.live.image_shown, check_params_cb=lambda shown: shown.seen.camera == 1
    ):
        pass
    live.until(lambda: len(places(live)) == N_LEDS and are_apart(first, places(live)))
    workbench.live.set_exposure(400.0)
    live.until(lambda: workbench.live.connection is Connection.STREAMING)

    workbench.selection.set_preparation(
        workbench.selection.preparation.with_mask(1, np.array([[5.0, 5.0, 3.0]]))
    )
    assert not len(workbench.selection.preparation.mask)
    live.until(lambda: not workbench.selection.preparation.camera_missing_inputs())
    live.page.left()
    assert workbench.live.chosen == 0

    live.page.entered()
    ask_for_second(live)
    assert workbench.selection.preparation.second is None
    live.until(lambda: workbench.live.n_cameras == 1)


def test_a_rig_file_that_cannot_be_read_is_reported_where_it_was_chosen(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    ask_for_second(live)
    live.wait("Baseline")
    (tmp_path / "rig.json").write_text("{}")
    panel = live.child(RigPanel)
    panel._path.accept(str(tmp_path / "rig.json"))

    live.until(lambda: "no rig file" in panel._problem.value().text)
    assert panel._problem.value().tone is Tone.BAD
    assert workbench.selection.preparation.rig_file is not None
    assert "remains in use: Baseline" in live.words

    workbench.selection.changed.emit(workbench.selection.preparation)
    assert "no rig file" in panel._problem.value().text

    ask_for_second(live)
    assert not panel._problem.value().text


def test_cameras_out_of_step_are_reported_with_what_that_costs(live: "Seen") -> None:
    ask_for_second(live)
    live.wait("Baseline")
    panel = live.child(RigPanel)
    panel.set_step(not_synchronised(12.5, 2.0), 3)

    assert "12.5 ms apart" in live.words
    assert "Unpaired images: 3" in live.words


# Live image


def test_each_led_has_a_ring_with_its_number(live: "Seen") -> None:
    assert numbers(live) == {str(led) for led in range(1, 11)}
    assert others(live) == []


def test_leds_rate_and_size_stand_above_the_image(live: "Seen", qtbot: QtBot) -> None:
    panel = live.child(LivePanel)
    qtbot.waitUntil(lambda: panel._figures.text().endswith("1224 x 1024 px"))

    assert panel._figures.text().startswith("10 of 10 LEDs")


def test_spots_that_are_no_leds_are_dashed(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    plugged(workbench, small_scene, *LAMPS)
    seen.page.entered()

    seen.wait("10 of 10 LEDs, other spots: 2")
    assert len(others(seen)) == 2
    assert exposure(seen) == "OK: 10 LEDs"


def test_without_a_pen_file_all_spots_are_equal(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, pen_file=None)
    )
    plugged(workbench, small_scene, LAMPS[0])
    seen.page.entered()

    seen.wait("Bright spots: 11")
    assert {marker.tone for marker in seen.markers} == {Tone.ACTIVE}
    assert exposure(seen) == "OK: 11 spots"


def test_images_are_taken_only_while_the_page_is_shown(
    live: "Seen", workbench: Workbench, qtbot: QtBot
) -> None:
    live.page.left()
    before = live.markers
    for _ in range(3):
        with qtbot.waitSignal(workbench.live.image_shown):
            pass

    assert live.markers is before


def test_a_sharp_image_has_narrow_rims(live: "Seen") -> None:
    panel = live.child(FocusPanel)

    live.until(lambda: 1 < float(panel._number.text().partition(" ")[0] or 0) < 3)
    assert panel._verdict.value().text == "In focus"


# Exposure and gain


def test_a_long_exposure_saturates_and_a_short_one_is_dark(live: "Seen") -> None:
    assert "All LEDs are correctly exposed." in live.words

    live.enter("Exposure", "4")
    live.until(lambda: exposure(live) == "Saturated: 10 of 10 LEDs")
    assert "Shorten the exposure until no LED is saturated." in live.words
    assert "Reduce the exposure first:" in live.words

    live.enter("Exposure", "0.2")
    live.until(lambda: exposure(live) == "Too dark: 10 of 10 LEDs")
    assert "Lengthen the exposure until all LEDs are OK." in live.words
    assert "Turn the focus ring" in live.words


def test_gain_that_saturates_is_to_be_lowered(live: "Seen") -> None:
    live.enter("Gain", "12")

    live.until(lambda: exposure(live) == "Saturated: 10 of 10 LEDs")
    assert "Lower the gain until no LED is saturated." in live.words


def test_exposure_and_gain_in_force_are_shown(
    seen: "Seen", workbench: Workbench, qtbot: QtBot
) -> None:
    workbench.camera.open()
    seen.page.entered()
    seen.wait("10 of 10 LEDs")
    with qtbot.waitSignal(workbench.live.settings_applied):
        workbench.live.set_exposure(2500.0)

    exposure, gain = seen.named("Exposure"), seen.named("Gain")
    assert isinstance(exposure, NumberField)
    assert isinstance(gain, NumberField)
    assert (exposure.text(), gain.text()) == ("2.50 ms", "0.0 dB")


def test_recorded_images_have_no_exposure_to_set(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    place = str(recording(tmp_path / "swing"))
    source = SourceChoice(SourceKind.RECORDED, place)
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, source=source)
    )
    seen.page.entered()

    seen.wait("Recorded images: exposure and gain are fixed.")
    seen.wait("Recorded images: focus is fixed.")
    seen.wait("SIMULATED")  # as the files in use are of the simulated pen
    assert "Live" not in seen.words
    with pytest.raises(AssertionError):
        seen.named("Exposure")


# Intrinsics


def test_the_checks_of_the_intrinsics_are_shown(live: "Seen") -> None:
    assert "Size fits: 1224 x 1024" in live.words
    assert re.search(
        r"2319\.10 \u00b1 0\.5\d and 2318\.55 \u00b1 0\.5\d px \(k = 2\)", live.words
    ), live.words
    assert "k1 -0.082" in live.words
    assert "No date" in live.words


def test_intrinsics_without_an_uncertainty_are_said_to_be_so(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    live.enter("Intrinsics file", str(intrinsics(workbench, tmp_path, covariance=None)))

    live.wait("2319.10 and 2318.55 px")
    assert "No date, no uncertainty in the file" in live.words


def test_date_and_uncertainty_of_the_intrinsics_are_shown(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = intrinsics(
        workbench,
        tmp_path,
        distortion=np.array([-0.082, 0.105, 3.0004e-4, -2e-4, -2.075e-12]),
        covariance=np.diag([0.25, 0.16, 0.04, 0.09, *[0.0] * 5]),
        calibrated_on=date(2025, 8, 14),
    )

    live.enter("Intrinsics file", str(path))

    live.wait("2319.10 \u00b1 1.00 and 2318.55 \u00b1 0.80 px (k = 2)")
    of_lens = "k1 -0.082, k2 0.105, p1 0.0003, p2 -0.0002, k3 0\n"
    assert of_lens in live.words.replace("\xa0", " ")
    assert "14" in live.words
    assert "2025" in live.words
    assert "no uncertainty" not in live.words


def test_intrinsics_of_another_camera_and_of_long_ago_are_doubted(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = intrinsics(
        workbench, tmp_path, serial="DEV-99", calibrated_on=date(2020, 1, 2)
    )

    live.enter("Intrinsics file", str(path))

    live.wait("The intrinsics file belongs to camera DEV-99")
    assert "on 2020-01-02" in live.words


def test_facts_that_are_not_known_take_no_focus(
    live: "Seen", workbench: Workbench
) -> None:
    facts = live.child(IntrinsicsPanel).findChildren(QLabel)
    selectable = Qt.TextInteractionFlag.TextSelectableByMouse
    reported = [each for each in facts if each.textInteractionFlags() & selectable]
    assert len(reported) == 4
    assert all(each.text() for each in reported)

    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, camera_file=None)
    )

    focusable = [each for each in facts if each.focusPolicy() != Qt.FocusPolicy.NoFocus]
    assert focusable == []


def test_a_file_for_images_of_another_size_is_reported_and_stops_the_step(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = intrinsics(workbench, tmp_path, width=612, height=512)

    live.enter("Intrinsics file", str(path))

    live.wait(
        "Image size is 1224 x 1024; the intrinsics file is for 612 x 512. Choose "
        "the file of this camera, or say how the images are binned or cropped."
    )
    assert not live.page.is_complete()
    assert (
        "The intrinsics file is for another image size."
        in live.page.main_action().why_not
    )


def test_a_file_of_the_whole_sensor_is_used_for_binned_images(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = intrinsics(workbench, tmp_path, width=2448, height=2048)
    live.enter("Intrinsics file", str(path))
    live.wait("the intrinsics file is for 2448 x 2048")

    live.click("Binned or cropped images...")
    dialog = live.child(PartDialog)
    binning = dialog.findChildren(NumberField)[0]
    binning.selectAll()
    QTest.keyClicks(binning, "2")
    QTest.mouseClick(
        next(b for b in dialog.findChildren(QPushButton) if "use" in b.text()),
        Qt.MouseButton.LeftButton,
    )

    live.wait("Size fits: 1224 x 1024")
    used = workbench.selection.preparation.camera_file
    assert used is not None
    assert used.path == path.with_name(f"{path.stem}-binned-2.yaml")
    panel = live.child(IntrinsicsPanel)
    shown = [b.text() for b in panel.findChildren(QPushButton) if b.isVisible()]
    assert "Binned or cropped images..." not in shown


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "does not exist"),
        ("image_width: 1224\nimage_height: [", "Line 3 of other.yaml is not valid"),
    ],
)
def test_an_unfit_file_is_reported_beside_the_field_and_the_one_before_stays(
    live: "Seen",
    workbench: Workbench,
    tmp_path: Path,
    content: str | None,
    sentence: str,
) -> None:
    path = tmp_path / "other.yaml"
    if content is not None:
        path.write_text(content)
    before = workbench.selection.preparation.camera_file

    live.enter("Intrinsics file", str(path))

    live.wait(sentence)
    assert "In use\ncamera.yaml" in live.words
    assert workbench.selection.preparation.camera_file is before
    assert live.page.is_complete()
    field = live.named("Intrinsics file")
    assert isinstance(field, QLineEdit)
    assert field.text() == str(path)
    assert "Size fits:" in live.words


def test_the_complaint_goes_with_a_fit_file(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    live.enter("Intrinsics file", str(tmp_path / "nowhere.yaml"))
    live.wait("does not exist")

    live.enter("Intrinsics file", f'"{intrinsics(workbench, tmp_path)}"')

    live.until(lambda: "does not exist" not in live.words)
    assert workbench.selection.preparation.camera_file is not None
    assert workbench.selection.preparation.camera_file.path.name == "other.yaml"


def test_a_file_is_opened_in_the_dialog(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = intrinsics(workbench, tmp_path)
    live.click("Open...")
    dialog = live.child(QFileDialog)
    dialog.selectFile(str(path))
    dialog.accept()

    live.until(lambda: workbench.selection.preparation.camera_file.path == path)  # type: ignore[union-attr]


def test_the_files_of_the_simulated_pen_are_used_at_a_click(
    seen: "Seen", workbench: Workbench
) -> None:
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, camera_file=None, pen_file=None)
    )
    seen.page.entered()
    seen.wait("Open the intrinsics file of this camera and lens.")
    assert not seen.page.is_complete()
    assert seen.page.main_action().why_not

    seen.click("Use its files")

    seen.wait("Size fits:")
    assert workbench.selection.preparation.pen_file is not None
    assert seen.page.is_complete()


# Recorded images


def test_a_recording_asks_where_it_is(live: "Seen", workbench: Workbench) -> None:
    live.choose("Recorded images")

    live.wait("Choose the folder of the recorded images.")
    assert live.page.main_action().why_not == (
        "Choose the folder of the recorded images."
    )
    assert live.markers == ()
    assert exposure(live) == "No LED detected"
    assert live.named("Folder, record or video").hasFocus()


def test_a_camera_of_a_driver_asks_for_a_search(live: "Seen") -> None:
    pytest.importorskip("lightpen_extensions.drivers")
    live.choose("Recorded images")
    live.choose("GenICam with a vendor's GenTL producer")
    live.wait("Search for the camera and choose it.")


def test_a_folder_and_an_intrinsics_file_are_dropped_on_their_places(
    live: "Seen", workbench: Workbench, small_scene: Scene, tmp_path: Path
) -> None:
    write_scene(replace(small_scene, n_images=2), tmp_path / "swing")
    drop_on(live.child(SourcePanel), tmp_path / "swing")
    live.until(
        lambda: workbench.selection.preparation.source.place == str(tmp_path / "swing")
    )
    drop_on(live.child(IntrinsicsPanel), tmp_path / "swing" / "camera.yaml")

    live.wait("Size fits:")


def drop_on(panel: QWidget, path: Path) -> None:
    """Drop a file or a folder of this machine."""
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path))])
    held = (
        *(Qt.DropAction.CopyAction, data),
        *(Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier),
    )
    QApplication.sendEvent(panel, QDragEnterEvent(QPoint(5, 5), *held))
    QApplication.sendEvent(panel, QDropEvent(QPointF(5, 5), *held))


def test_a_folder_is_picked_in_the_dialog(
    live: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    folder = recording(tmp_path / "swing")
    live.choose("Recorded images")
    button = live.named("Open...")
    assert isinstance(button, QPushButton)
    button.menu().actions()[0].trigger()
    dialog = live.child(QFileDialog)
    dialog.setDirectory(str(folder))
    dialog.accept()

    live.until(lambda: workbench.selection.preparation.source.place == str(folder))
    live.wait("80 x 64 px")


def test_a_missing_folder_is_reported_and_tried_again(
    live: "Seen", tmp_path: Path
) -> None:
    folder = tmp_path / "swing"
    live.choose("Recorded images")
    live.enter("Folder, record or video", str(folder))
    live.wait(f"There is no folder, video or image at {folder}. Check the name.")
    assert "Not connected" in live.words

    recording(folder)
    live.click("Try again")

    live.wait("80 x 64 px")
    assert "RECORDED" in live.words


def test_the_pen_is_back_after_a_recording(
    live: "Seen", workbench: Workbench, tmp_path: Path, qtbot: QtBot
) -> None:
    live.choose("Recorded images")
    live.enter("Folder, record or video", str(tmp_path / "nowhere"))
    live.wait("There is no folder")

    with qtbot.waitSignal(workbench.notifications.withdrawn) as notice:
        live.choose("Simulated pen")

    assert str(notice.args).startswith("['There is no folder")
    live.wait("10 of 10 LEDs")
    assert "There is no folder" not in live.words


def test_cameras_that_are_found_late_are_not_taken_for_another_source(
    seen: "Seen", workbench: Workbench
) -> None:
    panel = seen.child(SourcePanel)
    workbench.selection.set_preparation(
        workbench.selection.preparation.with_source(SourceChoice("aravis"))
    )
    panel.set_searching(True)
    recorded = SourceChoice(SourceKind.RECORDED)
    workbench.selection.set_preparation(
        workbench.selection.preparation.with_source(recorded)
    )

    workbench.camera.cameras_found.emit((FoundDevice("LP02", "Aravis Fake (LP02)"),))

    assert panel.value() == recorded
    assert workbench.selection.preparation.source == recorded


# A camera that fails


def test_a_camera_that_is_unplugged_is_reported_and_comes_back(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    camera = plugged(workbench, small_scene)
    seen.page.entered()
    seen.wait("10 of 10 LEDs")

    camera.unplug()
    seen.wait("Lost, reconnecting")
    assert "Check cable and power." in seen.words
    assert "Reconnecting automatically." in seen.words
    assert seen.markers == ()
    assert not seen.named("Search").isEnabled()

    camera.plug_in()
    seen.wait("10 of 10 LEDs")
    assert "Live" in seen.words


def test_a_search_ends_with_the_images(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    camera = plugged(workbench, small_scene)
    seen.page.entered()
    seen.wait("10 of 10 LEDs")
    camera.stall(4.0)
    seen.click("Search")

    seen.wait("No images")

    assert "Searching" not in seen.words


# Stray light


@pytest.mark.slow
def test_what_shines_beside_the_covered_pen_is_found_and_masked(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    plugged(workbench, small_scene, *LAMPS)
    seen.page.resize(764, 372)  # in the smallest window
    seen.page.entered()
    seen.wait("10 of 10 LEDs, other spots: 2")

    operator_of(workbench).cover()
    seen.wait("too few LEDs")
    seen.click("Search")
    seen.wait("Stray spots: 2.")
    reported = next(x for x in seen.page.findChildren(QLabel) if "Stray sp" in x.text())
    seen.until(lambda: reported.visibleRegion().boundingRect() == reported.rect())
    seen.until(lambda: [m.label for m in seen.markers] == ["stray", "stray"])

    seen.click("Mask the spots: 2")
    seen.wait("Masked areas: 2")
    operator_of(workbench).uncover()
    seen.wait("10 of 10 LEDs")
    seen.until(lambda: not others(seen))
    assert len(crossed(seen)) == 2
    assert len(workbench.selection.preparation.mask) == 2


def test_a_mask_is_cleared(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    mask = np.array([[*lamp.center, 30.0] for lamp in LAMPS])
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, mask=mask)
    )
    plugged(workbench, small_scene, *LAMPS)
    seen.page.entered()
    seen.wait("10 of 10 LEDs")
    seen.until(lambda: len(crossed(seen)) == 2)

    seen.click("Clear mask")

    seen.until(lambda: len(others(seen)) == 2)
    assert crossed(seen) == []
    assert not seen.named("Clear mask").isEnabled()


def test_a_mask_adds_to_the_one_before(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    first = np.array([[*LAMPS[0].center, 30.0]])
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, mask=first)
    )
    plugged(workbench, small_scene, *LAMPS).operator.move_away()
    seen.page.entered()
    seen.wait("Live")
    operator_of(workbench).cover()
    seen.wait("too few LEDs")

    seen.click("Search")
    seen.wait("Stray spots: 1.")
    seen.click("Mask the spots: 1")

    assert len(workbench.selection.preparation.mask) == 2


@pytest.mark.slow
def test_a_pen_that_is_still_seen_is_not_masked(live: "Seen") -> None:
    live.click("Search")

    live.wait("The pen is still visible;")
    assert not live.named("Mask the spots").isEnabled()


def test_nothing_left_is_reported(live: "Seen", workbench: Workbench) -> None:
    operator_of(workbench).cover()
    live.wait("no LED seen")

    live.click("Search")

    live.wait("No stray light found.")


def test_without_a_pen_file_the_operator_is_asked_whether_it_is_covered(
    seen: "Seen", workbench: Workbench
) -> None:
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, pen_file=None)
    )
    seen.page.entered()
    seen.wait("Bright spots: 10")
    operator = workbench.live.operator
    assert isinstance(operator, SimulatedOperator)
    seen.until(lambda: operator.doing is HandActivity.SEATED)

    seen.click("Search")

    seen.wait("Bright spots: 10. Is the pen covered?")


def test_what_shines_and_moves_is_no_stray_light(
    qtbot: QtBot, workbench: Workbench
) -> None:
    live = workbench.live
    panel = StrayLightPanel(workbench.selection, live, LivePanel())
    qtbot.addWidget(panel)
    panel.set_live(True)
    (search,) = (b for b in panel.findChildren(QPushButton) if b.text() == "Search")
    QTest.mouseClick(search, Qt.MouseButton.LeftButton)

    for i in range(SEARCHED_IMAGES):
        image = np.zeros((256, 512), np.uint8)
        cv2.circle(image, (60 + 40 * i, 128), 9, 200, cv2.FILLED)
        frame = Frame(sealed(image), i, 0)
        panel.feed(LiveImage(frame, detect_spots(frame.image), None))

    assert (
        panel.outcome()
        .value()
        .text.startswith("The bright spots move and are not stray light.")
    )
    assert len(panel._found) == 0


def test_a_grey_button_says_why(seen: "Seen") -> None:
    reasons = {
        name: seen.named(name).toolTip()
        for name in ("Search", "Mask the spots", "Clear mask")
    }

    assert reasons == {
        "Search": "No images are received.",
        "Mask the spots": "No spots to mask",
        "Clear mask": "No mask is set.",
    }


# The step among the others


@pytest.fixture
def window(
    live: "Seen", workbench: Workbench, settings: Settings, qtbot: QtBot
) -> MainWindow:
    window = MainWindow(
        [live.page, BlankPage("leds")], settings, Preferences(), workbench.notifications
    )
    qtbot.addWidget(window)
    window.show()
    return window


@pytest.mark.slow
def test_the_fault_of_a_swing_is_not_taken_for_one_of_the_camera(
    window: MainWindow, live: "Seen", workbench: Workbench
) -> None:
    workbench.notifications.notify("a swing", "The disk is full.")

    workbench.live.close()
    live.wait("No camera is open.")
    assert "The disk is full." not in live.words
    live.choose("Recorded images")

    assert "The disk is full." in window.words()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("field", "text"),
    [("Intrinsics file", "/nowhere.yaml"), ("Exposure", "2"), ("Gain", "1")],
)
def test_enter_in_a_field_does_not_leave_the_step(
    window: MainWindow, live: "Seen", field: str, text: str
) -> None:
    live.enter(field, text)

    assert window.page() is live.page


def test_names_come_before_the_camera(page: CameraPage, workbench: Workbench) -> None:
    assert page.why_closed() == ""

    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, names=Names())
    )

    assert page.why_closed() == "Enter the name of the station."


def test_a_swing_under_way_is_reported(live: "Seen", workbench: Workbench) -> None:
    assert "A swing is in progress." not in live.words

    chosen = workbench.selection.preparation
    workbench.run.runner.ask(lambda workflow: workflow.begin(chosen))

    live.wait("A swing is in progress.")
