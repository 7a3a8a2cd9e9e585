"""The step LEDs as an operator sees it: file, table, pen in space and live match."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QComboBox, QFileDialog, QLineEdit
from pytestqt.qtbot import QtBot
from tests.app.undressed import undressed
from tests.faulty_camera import FaultyCamera
from tests.simulated_pens import fanned_pen, six_led_pen

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import CameraSettings
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import write_pen
from lightpen.messages import message
from lightpen.model.rigid import rotation_from_vector
from lightpen.pen_check.match import Finding, PenMatch
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.tip_library import LedFile, ListedPen, read_library
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import Tone
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.steps.leds.match_panel import MatchPanel
from lightpen_app.steps.leds.page import LedsPage
from lightpen_app.steps.leds.table_panel import MISFIT, LedTable
from lightpen_app.widgets.bars import QuestionBar
from lightpen_app.widgets.pen_view import PenView
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.hand import HandActivity
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_pen

if TYPE_CHECKING:
    from tests.app.steps.conftest import See, Seen

LEDS = paper_pen().leds
X, Y, Z = 1, 2, 3  # columns of the table


def why_not(seen: "Seen") -> str:
    return seen.page.main_action().why_not


def led_table(seen: "Seen") -> LedTable:
    return seen.child(LedTable)


def shown_path(seen: "Seen") -> str:
    field = seen.named("LED file")
    assert isinstance(field, QLineEdit)
    return field.text()


def open_file(seen: "Seen", path: Path) -> None:
    seen.enter("LED file", str(path))


def cell(seen: "Seen", led: int, column: int) -> str:
    return str(led_table(seen).model().index(led - 1, column).data())


def reported(seen: "Seen", led: int) -> str:
    """Return what the table says of an LED."""
    index = led_table(seen).model().index(led - 1, 0)
    return str(index.data(Qt.ItemDataRole.ToolTipRole) or "")


@pytest.fixture
def seen(qtbot: QtBot, workbench: Workbench, see: "See") -> Iterator["Seen"]:
    with undressed():
        page = LedsPage(workbench)
    qtbot.addWidget(page)
    page.resize(976, 600)
    page.show()
    page.activateWindow()
    yield see(page)
    page.left()
    page.shut_down()


@pytest.fixture
def live(seen: "Seen", workbench: Workbench, small_scene: Scene) -> "Seen":
    """The page with a camera before which the pen is swung in the cone."""
    plugged(workbench, small_scene)
    seen.page.entered()
    return seen


def plugged(workbench: Workbench, scene: Scene) -> FaultyCamera:
    camera = FaultyCamera(scene, workbench.around.clock)
    workbench.live.open([camera], CameraSettings(), workbench.around.clock)
    camera.operator.seat()
    camera.operator.swing()
    return camera


def in_use(workbench: Workbench) -> PenFile:
    file = workbench.selection.preparation.pen_file
    assert file is not None
    return file


def write_table(path: Path, leds: FloatArray, units: str = "_mm") -> Path:
    """Write a table without normals, as a measuring machine's program does."""
    rows = [f"{i},{x},{y},{z}" for i, (x, y, z) in enumerate(leds.tolist(), 1)]
    header = f"led,x{units},y{units},z{units}"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def exchanged() -> FloatArray:
    leds = LEDS.copy()
    leds[[4, 7]] = leds[[7, 4]]
    return leds


def raw() -> FloatArray:
    R = rotation_from_vector(np.array([0.3, 1.0, 0.2]))
    return np.asarray(LEDS @ R.T + [400.0, 300.0, 20.0])


# What is in use


def test_the_file_in_use_is_shown(seen: "Seen", workbench: Workbench) -> None:
    assert shown_path(seen) == str(in_use(workbench).path)
    assert [cell(seen, 8, column) for column in (X, Y, Z)] == ["25", "35", "0"]
    assert "The LEDs are in the pen frame." in seen.words
    assert "Disc \u00d8 10 mm" in seen.words
    assert "Nominal tip: 0  -90  -25 mm" in seen.words
    assert seen.page.is_complete()
    assert why_not(seen) == ""


def test_without_a_file_one_has_to_be_opened(
    seen: "Seen", workbench: Workbench
) -> None:
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, pen_file=None)
    )

    assert why_not(seen) == "Open the LED geometry file."
    assert not seen.page.is_complete()
    assert led_table(seen).model().rowCount() == 0


def test_the_simulated_pens_file_is_used_at_a_click(
    seen: "Seen", workbench: Workbench
) -> None:
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, pen_file=None)
    )

    seen.click("Use file of the simulated pen")
    seen.settle()

    assert in_use(workbench).path.name == "pen.json"
    assert seen.page.is_complete()


def test_a_pen_is_to_be_held_before_a_camera_alone(
    seen: "Seen", workbench: Workbench
) -> None:
    assert seen.page.lead().endswith(
        "Open the LED file of this pen and hold the pen in view of the camera."
    )

    recorded = SourceChoice(SourceKind.RECORDED, "")
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, source=recorded)
    )
    assert seen.page.lead().endswith("It is compared with the recorded images.")
    assert not seen.shows("Use file of the simulated pen")


def test_the_step_is_closed_until_names_and_camera_are_there(
    seen: "Seen", workbench: Workbench
) -> None:
    assert seen.page.why_closed() == "No image received from the camera yet."

    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, image_size=(1224, 1024))
    )
    assert seen.page.why_closed() == ""

    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, names=Names())
    )
    assert seen.page.why_closed() == "Enter the name of the station."


# Opening files


def test_another_file_is_opened(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    write_pen(fanned_pen(), path := tmp_path / "fanned.json")

    open_file(seen, path)

    assert in_use(workbench).path == path
    assert not led_table(seen).isColumnHidden(4)  # its discs do not all face +z
    assert seen.page.is_complete()


def test_a_file_is_picked_in_a_dialog(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = write_table(tmp_path / "leds.csv", LEDS)
    seen.click("Open...")
    dialog = seen.child(QFileDialog)
    dialog.selectFile(str(path))
    dialog.accept()
    seen.settle()

    assert in_use(workbench).path == path


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("led,x_mm,y_mm,z_mm\n1,12.4O,0,0\n", "Line 2 of bad.csv: "),
        (None, "bad.csv does not exist"),
    ],
)
def test_an_error_in_a_file_is_reported_and_the_one_before_stays(
    seen: "Seen",
    workbench: Workbench,
    tmp_path: Path,
    content: str | None,
    sentence: str,
) -> None:
    before = in_use(workbench)
    path = tmp_path / "bad.csv"
    if content is not None:
        path.write_text(content)

    open_file(seen, path)

    assert sentence in seen.words
    assert in_use(workbench) is before
    assert cell(seen, 8, Y) == "35"
    assert seen.page.is_complete()


def test_units_are_asked_for_where_a_file_does_not_say_them(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = write_table(tmp_path / "leds.csv", LEDS / 25.4, units="")

    open_file(seen, path)
    assert "leds.csv does not state the unit of its coordinates." in seen.words
    choice = seen.named("Unit of the file")
    assert isinstance(choice, QComboBox)
    assert choice.hasFocus()
    QTest.keyClicks(choice, "inch")
    choice.textActivated.emit(choice.currentText())
    seen.settle()

    file = in_use(workbench)
    assert (file.path, file.units) == (path, "inch")
    np.testing.assert_allclose(file.pen.leds, LEDS, atol=1e-9)
    assert "does not state the unit of its coordinates." not in seen.words


def test_a_pen_of_another_layout_keeps_its_frame(seen: "Seen", tmp_path: Path) -> None:
    write_pen(six_led_pen(), path := tmp_path / "six.json")

    open_file(seen, path)

    assert "Other layout than the ten-LED pen;" in seen.words
    assert seen.page.is_complete()


# The pen frame


def save_as(seen: "Seen", path: Path) -> None:
    dialog = seen.child(QFileDialog)
    dialog.selectFile(str(path))
    dialog.accept()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    seen.settle()


def test_exchanged_leds_of_a_file_are_named_and_a_corrected_file_is_used(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = write_table(tmp_path / "swapped.csv", exchanged())

    open_file(seen, path)
    assert "swapped.csv: LEDs 5 and 8 are swapped" in seen.words
    assert cell(seen, 8, Y) == f"{exchanged()[7, 1]:g}"
    assert why_not(seen) == "Open the LED geometry file."  # none is in use

    seen.click("Swap 5 and 8")
    assert seen.child(QFileDialog).selectedFiles() == [
        str(tmp_path / "swapped corrected.json")
    ]
    save_as(seen, tmp_path / "good.json")

    assert "are swapped" not in seen.words
    assert not seen.shows("Swap 5 and 8")
    assert in_use(workbench).path == tmp_path / "good.json"
    assert shown_path(seen) == str(tmp_path / "good.json")
    np.testing.assert_array_equal(in_use(workbench).pen.leds, LEDS)
    assert why_not(seen) == ""


def test_another_file_takes_the_place_of_one_that_cannot_be_used(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    open_file(seen, write_table(tmp_path / "swapped.csv", exchanged()))
    open_file(seen, write_table(tmp_path / "leds.csv", LEDS))

    assert in_use(workbench).path == tmp_path / "leds.csv"
    assert "are swapped" not in seen.words
    assert seen.page.is_complete()


def test_a_corrected_file_that_cannot_be_written_is_reported(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    before = in_use(workbench)
    seen.child(LedFilePanel).save(paper_pen(), tmp_path / "no folder" / "leds.json")
    seen.settle()

    assert "leds.json" in seen.words
    assert in_use(workbench) is before


def test_raw_coordinates_are_put_into_the_pen_frame(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    open_file(seen, write_table(tmp_path / "raw.csv", raw()))
    assert "The LEDs are not in the pen frame" in seen.words

    seen.click("Transform to pen frame")
    save_as(seen, tmp_path / "leds.json")

    assert "not in the pen frame" not in seen.words
    assert cell(seen, 8, Y) == "35"
    np.testing.assert_allclose(in_use(workbench).pen.leds, LEDS, atol=1e-5)


def test_a_pen_in_its_frame_need_not_be_moved(seen: "Seen") -> None:
    with pytest.raises(AssertionError):
        seen.named("Transform to pen frame")


# A file that is edited by another program


def test_a_file_that_has_changed_is_read_again(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = write_table(tmp_path / "leds.csv", LEDS)
    open_file(seen, path)

    moved = LEDS.copy()
    moved[6, 1] += 0.25
    write_table(path, moved)
    seen.until(lambda: cell(seen, 7, Y) == "160.25")
    moved[6, 1] += 0.25
    write_table(tmp_path / "new.csv", moved).replace(path)
    seen.until(lambda: cell(seen, 7, Y) == "160.5")

    assert in_use(workbench).pen.leds[6, 1] == 160.5


@pytest.fixture
def test_the_nominal_tip_of_the_first_step_is_reported_where_it_rules(
    seen: "Seen", workbench: Workbench
) -> None:
    tip = np.array([1.0, -80.0, -20.0])
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, nominal_tip=tip)
    )

    words = "Nominal tip in use (step Start): 1  -80  -20 mm"
    assert words in seen.words
    shown = seen.child(PenView).value().tip
    assert shown is not None
    assert shown.tolist() == tip.tolist()


def test_row_and_disc_are_chosen_together(seen: "Seen") -> None:
    view = seen.child(PenView)
    led_table(seen).set_chosen(4)
    assert view._chosen == 4

    place = view.place_of(7).toPoint()
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=place)
    assert (led_table(seen).currentRow(), view._chosen) == (6, 7)


# The live match


def test_a_pen_that_fits_is_said_to(live: "Seen") -> None:
    live.wait("10 of 10 LEDs")
    live.wait("All LEDs fit their table positions, in")

    assert "RMS residual 0.0" in live.words
    assert live.child(StateBanner).value().tone is Tone.GOOD
    live.qtbot.waitUntil(lambda: cell(live, 7, MISFIT).startswith("0.0"))
    labels = {marker.label for marker in live.markers}
    assert labels <= {str(led) for led in range(1, 11)} | {""}


@pytest.mark.slow
def test_a_bug_in_the_comparison_leaves_no_old_finding_and_the_next_views_are_compared(
    live: "Seen", monkeypatch: pytest.MonkeyPatch
) -> None:
    caught: list[BaseException] = []
    monkeypatch.setattr("sys.excepthook", lambda _, error, __: caught.append(error))
    live.wait("All LEDs fit their table positions, in")
    with monkeypatch.context() as broken:
        broken.setattr(
            "lightpen_app.steps.leds.match_panel.match_pen", lambda *_: 1 / 0
        )
        live.qtbot.waitUntil(lambda: bool(caught))
        live.qtbot.waitUntil(lambda: not cell(live, 7, MISFIT))
        assert "Every LED sits" not in live.words

    live.wait("All LEDs fit their table positions, in")
    live.qtbot.waitUntil(lambda: cell(live, 7, MISFIT).startswith("0.0"))
    assert all(isinstance(error, ZeroDivisionError) for error in caught)


@pytest.mark.slow
def test_a_displaced_led_is_named_and_marked_everywhere(
    live: "Seen", tmp_path: Path
) -> None:
    live.wait("10 of 10 LEDs")
    moved = LEDS.copy()
    moved[6, 1] += 0.5

    open_file(live, write_table(tmp_path / "moved.csv", moved))

    live.wait("LED 7 is not where the LED file has it")
    assert "LED 7 is not where" in reported(live, 7)
    assert float(cell(live, 7, MISFIT)) > 0.5
    assert live.child(PenView).value().marked == {7}
    assert live.child(StateBanner).value().tone is Tone.WARN


@pytest.mark.slow
@pytest.mark.slow
def test_the_match_follows_the_file_and_another_page_sees_the_pen_in_use(
    live: "Seen", workbench: Workbench, qtbot: QtBot, tmp_path: Path
) -> None:
    open_file(live, write_table(tmp_path / "nine.csv", LEDS[:9]))
    live.wait("9 of 9 LEDs")
    assert in_use(workbench).pen.n_leds == 9

    live.page.left()

    def sees_all(shown: DisplayedImage) -> bool:
        detection = shown.seen.detection
        return detection is not None and len(detection.pixels) == 9

    with qtbot.waitSignal(workbench.live.image_shown, check_params_cb=sees_all):
        pass


def test_a_covered_led_is_reported(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    camera = plugged(workbench, small_scene)
    camera.operator.cover(leds=[6])
    seen.page.entered()

    seen.wait("LED 6 is not detected at its table position.")
    assert "9 of 10 LEDs" in seen.words


@pytest.mark.slow
def test_the_simulated_pen_turns_by_itself(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    camera = FaultyCamera(small_scene, workbench.around.clock)
    workbench.live.open([camera], CameraSettings(), workbench.around.clock)
    seen.page.entered()
    seen.wait("All LEDs fit their table positions")

    seen.page.left()  # the swing finds the pen at rest
    seen.until(lambda: camera.operator.doing is HandActivity.SEATED)


def test_the_file_of_another_pen_is_used_after_a_question_only(
    seen: "Seen", workbench: Workbench, tmp_path: Path
) -> None:
    path = write_table(tmp_path / "lp05.csv", LEDS + np.array([0.0, 0.0, 0.1]))
    other = LedFile(str(path), PenFile.read(path).sha256)
    add_item(
        workbench.folder,
        ListedPen(id="LP-05", led_file=other),
        Author("Hall 2", "Ann"),
        workbench.around.now(),
    )
    workbench.library.refresh()
    seen.settle()
    source = SourceChoice(SourceKind.RECORDED, str(tmp_path))
    now = workbench.selection.preparation.with_source(source)
    workbench.selection.set_preparation(now)

    open_file(seen, path)
    assert workbench.selection.preparation.pen_file is None
    assert "lp05.csv is the LED file of pen LP-05, not of pen LP-04." in seen.words

    seen.click("Use this file")
    assert in_use(workbench).path == path
    for _ in range(3):
        seen.settle()
    stored = read_library(workbench.folder).pens["LP-04"].led_file
    assert stored == other
    assert not seen.page.is_doubtful()


@pytest.mark.slow
def test_a_file_that_misfits_leaves_the_step_amber_and_asks_before_the_swing(
    live: "Seen", tmp_path: Path, qtbot: QtBot
) -> None:
    path = write_table(tmp_path / "other.csv", LEDS * [1.05, 1.0, 1.0])
    open_file(live, path)
    qtbot.waitUntil(live.page.is_doubtful)
    asked: list[None] = []
    live.page.advance_requested.connect(lambda: asked.append(None))

    live.page.run_main_action()

    assert live.child(QuestionBar).isVisible()
    assert not asked
    live.click("Cancel")
    assert not asked
    live.page.run_main_action()
    live.click("Swing anyway")
    assert len(asked) == 1


@pytest.mark.slow
def test_the_question_ends_when_the_pen_fits_after_all(
    seen: "Seen", workbench: Workbench, small_scene: Scene, qtbot: QtBot
) -> None:
    camera = FaultyCamera(small_scene, workbench.around.clock)
    camera.operator.cover(leds=[8, 9, 10])
    camera.operator.seat()
    workbench.live.open([camera], CameraSettings(), workbench.around.clock)
    seen.page.entered()
    qtbot.waitUntil(seen.page.is_doubtful)
    seen.page.run_main_action()
    assert seen.child(QuestionBar).isVisible()

    camera.operator.uncover()
    camera.operator.swing()
    qtbot.waitUntil(lambda: not seen.page.is_doubtful())

    assert not seen.child(QuestionBar).isVisible()


def test_a_pen_that_is_away_is_not_found(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    camera = FaultyCamera(small_scene, workbench.around.clock)
    workbench.live.open([camera], CameraSettings(), workbench.around.clock)
    seen.page.entered()
    seen.wait("10 of 10 LEDs")  # the simulated pen is shown by itself
    camera.operator.move_away()

    seen.wait("Pen not found")
    assert "No LED seen" in seen.words


def test_too_few_views_do_not_say_that_a_pen_fits(
    seen: "Seen", monkeypatch: pytest.MonkeyPatch
) -> None:
    seen.page.entered()
    panel = seen.child(MatchPanel)
    monkeypatch.setattr(panel, "_why_unknown", str)  # as with a camera

    panel.set_value(PenMatch(2, 2, np.full(10, 0.05), findings=()))

    assert "Tilt and turn the pen so that it is seen from all sides." in seen.words


def test_findings_are_shown_and_mark_their_leds(
    seen: "Seen", monkeypatch: pytest.MonkeyPatch
) -> None:
    panel = seen.child(MatchPanel)
    monkeypatch.setattr(panel, "_why_unknown", str)  # as with a camera
    finding = Finding(message("match.unseen", led=7), (7,))

    panel.set_value(PenMatch(9, 9, np.full(10, 0.05), (finding,)))

    assert "LED 7 is not detected at its table position." in seen.words
    assert set(panel.reasons()) == {7}


def test_what_is_missing_for_a_match_is_reported(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    seen.page.entered()
    assert "No camera is open. See the step Camera." in seen.words

    plugged(workbench, small_scene)
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, camera_file=None)
    )
    seen.wait("Intrinsics file missing. See the step Camera.")
    assert "No match yet" in seen.words


def test_a_camera_that_is_lost_leaves_no_old_image(
    seen: "Seen", workbench: Workbench, small_scene: Scene
) -> None:
    camera = plugged(workbench, small_scene)
    seen.page.entered()
    seen.wait("10 of 10 LEDs")

    camera.unplug()

    seen.wait("Camera connection lost. Reconnecting automatically.")
    assert seen.markers == ()

    camera.plug_in()
    seen.wait("10 of 10 LEDs")


def test_nothing_is_compared_while_another_page_is_shown(
    seen: "Seen", workbench: Workbench, small_scene: Scene, qtbot: QtBot
) -> None:
    plugged(workbench, small_scene)
    for _ in range(3):
        with qtbot.waitSignal(workbench.live.image_shown):
            pass

    assert seen.markers == ()


# What comes late, or in another language


def test_what_is_wrong_is_reported_in_the_language_that_is_chosen(
    seen: "Seen", tmp_path: Path, qapp: QApplication
) -> None:
    open_file(seen, write_table(tmp_path / "exchanged.csv", exchanged()))
    panel = seen.child(LedFilePanel)
    english = panel._problem.value().text

    LanguageSwitch(qapp).set_language("zh_CN")
    QApplication.processEvents()

    assert panel._problem.value().text not in ("", english)
