"""The tip library at the step Start: lists, its dialog, marks, and codes."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QCoreApplication, Qt, QThreadPool
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QLineEdit, QWidget
from pytestqt.qtbot import QtBot
from tests.app.undressed import undressed
from tests.entering import retire_item

from lightpen.local_time import local_now
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.supervision import Signature, set_password
from lightpen.record.library.tip_library import (
    ItemKind,
    Library,
    ListedCone,
    ListedPen,
    ListedTip,
    library_changes,
    library_files,
    read_library,
)
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.shell.sidebar import Sidebar, Subject, subject_of
from lightpen_app.steps.start.day_state import tip_details
from lightpen_app.steps.start.fields import ItemButton
from lightpen_app.steps.start.form import NamesForm
from lightpen_app.steps.start.library_dialog import LibraryDialog
from lightpen_app.steps.start.page import StartPage
from lightpen_app.widgets.bars import QuestionBar
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.widgets.tables import RowTable
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from tests.app.conftest import HoldBack

LEFT = Qt.MouseButton.LeftButton
ANN = Author("Hall 2", "Ann")
TIP = ListedTip(id="T-7", ball_diameter_mm=6.0, nominal_tip_mm=(0.0, -80.0, -20.0))


class Desk:
    """A Start page with the library of its data folder."""

    def __init__(self, qtbot: QtBot, workbench: Workbench) -> None:
        self.qtbot, self.workbench = qtbot, workbench
        with undressed():
            self.page = StartPage(workbench)
        self.reported: list[str] = []
        workbench.notifications.status_changed.connect(self.reported.append)
        qtbot.addWidget(self.page)
        self.page.resize(1000, 640)
        self.page.show()
        self.page.entered()
        self.page.show_setup()
        self.settle()

    def subject(self) -> Subject:
        """Return what the window says is calibrated."""
        now, chosen = self.workbench.run.status, self.workbench.selection.preparation
        return subject_of(now, chosen, self.workbench.library.statuses)

    @property
    def data(self) -> Path:
        return self.workbench.folder

    @property
    def library(self) -> Library:
        return read_library(self.data)

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """The texts of the table of the dialog."""
        (table,) = self.dialog.findChildren(RowTable)
        model = table.model()
        return tuple(
            tuple(model.index(i, j).data() for j in range(model.columnCount()))
            for i in range(model.rowCount())
        )

    @property
    def dialog(self) -> LibraryDialog:
        found = self.page.findChild(LibraryDialog)
        assert isinstance(found, LibraryDialog)
        return found

    @property
    def names(self) -> NamesForm:
        found = self.page.findChild(NamesForm)
        assert isinstance(found, NamesForm)
        return found

    def settle(self) -> None:
        """Let jobs end, and those that they began."""
        for _ in range(3):
            QThreadPool.globalInstance().waitForDone()
            QCoreApplication.processEvents()

    def add(self, *items: ListedPen | ListedTip | ListedCone) -> None:
        for item in items:
            add_item(self.data, item, ANN, local_now())
        self.workbench.library.refresh()
        self.settle()

    def control(self, name: str) -> QWidget:
        """Return the visible control of that name or with that on it."""
        dialog = self.page.findChild(LibraryDialog)
        is_open = isinstance(dialog, LibraryDialog) and dialog.isVisible()
        for each in (self.dialog if is_open else self.page).findChildren(QWidget):
            written = each.text() if isinstance(each, QAbstractButton) else ""
            if each.isVisible() and name in (written, each.accessibleName()):
                return each
        raise AssertionError(name)

    def list_of(self, kind: ItemKind) -> ItemButton:
        found = self.page.findChildren(ItemButton)
        names = {each.accessibleName(): each for each in found}
        return names[f"List of {kind.name.lower()}s"]

    def choices(self, kind: ItemKind) -> list[str]:
        return [each.text() for each in self.list_of(kind).menu().actions()]

    def click(self, name: str) -> None:
        QTest.mouseClick(self.control(name), LEFT)

    def enter(self, name: str, text: str) -> None:
        field = self.control(name)
        field.setFocus()
        QTest.keySequence(field, "Ctrl+A")
        QTest.keyClicks(field, text)

    def scan(self, code: str) -> None:
        """Let a scanner, or somebody, type a barcode and Enter on the day page."""
        self.page.show_day()
        self.enter("Search tips", code)
        QTest.keyClick(self.control("Search tips"), Qt.Key.Key_Return)
        self.page.show_setup()

    def text_of(self, name: str) -> str:
        field = self.control(name)
        assert isinstance(field, QLineEdit)
        return field.text()


@pytest.fixture
def desk(qtbot: QtBot, workbench: Workbench) -> Iterator[Desk]:
    desk = Desk(qtbot, workbench)
    yield desk
    desk.page.shut_down()
    QThreadPool.globalInstance().waitForDone()


@pytest.fixture
def of_real_pen(workbench: Workbench, tmp_path: Path) -> None:
    """Let images be of a real pen, whose tips are in force or due."""
    source = SourceChoice(SourceKind.RECORDED, str(tmp_path))
    workbench.selection.set_preparation(
        workbench.selection.preparation.with_source(source)
    )


def test_a_tip_is_exchanged_by_two_clicks_with_its_ball_and_centre(desk: Desk) -> None:
    desk.add(TIP, ListedTip(id="T-8"))

    desk.list_of(ItemKind.TIP).menu().actions()[0].trigger()

    now = desk.workbench.selection.preparation
    assert (now.names.tip, now.names.ball_diameter) == ("T-7", 6.0)
    assert now.nominal_tip is not None
    assert now.nominal_tip.tolist() == [0, -80, -20]
    assert desk.text_of("Probe tip") == "T-7"


@pytest.mark.qt_log_ignore("^This plugin does not support ")
def test_a_list_that_is_open_stays_as_it_is_while_the_library_is_read(
    desk: Desk,
) -> None:
    desk.add(TIP)
    button = desk.list_of(ItemKind.TIP)
    menu = button.menu()
    menu.popup(button.mapToGlobal(button.rect().bottomLeft()))
    QTest.keyClick(menu, Qt.Key.Key_Down)

    desk.add(ListedTip(id="T-1"))
    QTest.keyClick(menu, Qt.Key.Key_Return)
    assert desk.workbench.selection.preparation.names.tip == "T-7"
    menu.popup(button.mapToGlobal(button.rect().bottomLeft()))
    names = [each.text().partition("\t")[0] for each in menu.actions()]
    assert names[:2] == ["T-7", "T-1"]
    menu.close()


def test_pens_and_cones_are_chosen_from_their_lists(desk: Desk) -> None:
    desk.add(ListedPen(id="LP-9"), ListedCone(id="C-9"))

    for kind in (ItemKind.PEN, ItemKind.CONE):
        first, *others = desk.choices(kind)
        name = {ItemKind.PEN: "LP-9", ItemKind.CONE: "C-9"}[kind]
        assert (first.partition("\t")[0], others) == (name, ["", "Tip library..."])
        desk.list_of(kind).chosen.emit(name)
    names = desk.workbench.selection.preparation.names
    assert (names.pen, names.cone) == ("LP-9", "C-9")


def _said_of(sidebar: Sidebar) -> str:
    """Return what is said on an item that must not be used."""
    return sidebar.findChildren(SignLabel)[0].value().text


@pytest.mark.usefixtures("of_real_pen")
def test_a_tip_that_was_never_calibrated_is_marked_in_list_panel_and_side_bar(
    desk: Desk,
) -> None:
    desk.add(TIP, ListedCone(id="C-1", due=date(2020, 1, 1)))
    desk.list_of(ItemKind.TIP).chosen.emit("T-7")
    cone = desk.workbench.selection.preparation.names.cone
    desk.settle()

    assert desk.choices(ItemKind.TIP)[0] == "T-7\tNOT CALIBRATED"
    assert desk.subject().statuses.library.tips
    sidebar = Sidebar()
    desk.qtbot.addWidget(sidebar)
    reported: list[tuple[str, bool]] = []
    sidebar.subject_changed.connect(
        lambda text, marked: reported.append((text, marked))
    )
    subject = desk.subject()
    sidebar.set_subject(replace(subject, names=replace(subject.names, cone="C-1")))
    assert cone
    assert _said_of(sidebar) == ("Tip NOT CALIBRATED  \N{MIDDLE DOT}  Cone OVERDUE")
    assert _said_of(sidebar) in reported[-1][0]
    assert reported[-1][1]


def test_a_simulated_tip_is_not_marked(desk: Desk) -> None:
    desk.add(TIP)
    desk.list_of(ItemKind.TIP).chosen.emit("T-7")

    sidebar = Sidebar()
    desk.qtbot.addWidget(sidebar)
    sidebar.set_subject(desk.subject())
    assert _said_of(sidebar) == ""


def test_a_retired_tip_is_no_choice_and_typed_it_leads_no_further(desk: Desk) -> None:
    desk.add(TIP)
    retire_item(desk.data, ItemKind.TIP, "T-7", ANN, local_now())
    desk.workbench.library.refresh()
    desk.settle()

    assert desk.choices(ItemKind.TIP) == ["Tip library..."]
    desk.enter("Probe tip", "T-7")
    assert not desk.page.is_complete()
    assert desk.page.main_action().why_not == (
        "Tip T-7 is retired. Choose another tip, or reactivate it in the tip library."
    )


@pytest.mark.slow
def test_a_damaged_library_is_reported_until_it_is_mended(desk: Desk) -> None:
    reported, withdrawn = list[str](), list[str]()
    desk.workbench.notifications.raised.connect(lambda text, _: reported.append(text))
    desk.workbench.notifications.withdrawn.connect(withdrawn.append)
    desk.add(TIP)
    (file,) = library_files(desk.data)
    sound = file.read_bytes()
    file.write_bytes(sound.replace(b"T-7", b"T-6"))
    desk.workbench.library.refresh()
    desk.settle()
    assert "was changed before it was entered in the archive." in reported[-1]

    file.write_bytes(sound)
    desk.workbench.library.refresh()
    desk.settle()
    assert withdrawn == reported[-1:]


# The dialog


def test_a_tip_is_added_and_changed_in_the_dialog_and_entered_with_who(
    desk: Desk,
) -> None:
    desk.names.library_requested.emit(ItemKind.TIP)
    desk.click("Add...")
    desk.enter("ID (as on label)", "T-11")
    desk.enter("Expiry date", "2031-02-03")
    desk.enter("Reason for change", "new")
    desk.click("Save")
    desk.settle()
    assert desk.library.tips["T-11"].due == date(2031, 2, 3)
    assert desk.rows[0][0] == "T-11"

    desk.click("Change...")
    assert isinstance(field := desk.control("ID (as on label)"), QLineEdit)
    assert field.isReadOnly()
    desk.enter("Ball diameter", "8")
    desk.click("Save")
    desk.settle()
    tip = desk.library.tips["T-11"]
    assert tip.ball_diameter_mm == 8.0
    changes = [change for _, change in library_changes(desk.data)]
    assert [change.operator for change in changes] == ["Ann", "Ann"]
    assert changes[0].reason == "new"
    desk.click("Close")


@pytest.fixture
def slow_disk(hold_back: "HoldBack") -> Event:
    """Changes are kept once this is set."""
    return hold_back("lightpen_app.steps.start.library_control._changed")


def test_what_is_being_kept_is_neither_asked_for_again_nor_left(
    desk: Desk, slow_disk: Event
) -> None:
    desk.names.library_requested.emit(ItemKind.TIP)
    desk.click("Add...")
    desk.enter("ID (as on label)", "T-11")
    desk.click("Save")
    for name in ("Save", "Cancel"):
        assert not desk.control(name).isEnabled()
        assert desk.control(name).toolTip() == "Saving"

    slow_disk.set()
    desk.settle()
    assert desk.rows[0][0] == "T-11"
    desk.click("Close")


def keep_and_leave(desk: Desk, name: str) -> None:
    """Add a tip, and leave the dialog before it is kept."""
    desk.names.library_requested.emit(ItemKind.TIP)
    desk.click("Add...")
    desk.enter("ID (as on label)", name)
    desk.click("Save")
    QTest.keyClick(desk.dialog, Qt.Key.Key_Escape)


def test_what_is_typed_stays_when_the_change_before_is_kept(
    desk: Desk, slow_disk: Event
) -> None:
    keep_and_leave(desk, "T-11")
    desk.names.library_requested.emit(ItemKind.TIP)
    desk.click("Add...")
    desk.enter("ID (as on label)", "T-12")
    slow_disk.set()
    desk.settle()

    assert list(desk.library.tips) == ["T-11"]
    assert desk.text_of("ID (as on label)") == "T-12"
    desk.click("Cancel")
    desk.click("Close")


def test_a_change_that_is_asked_for_while_another_is_kept_is_kept_after_it(
    desk: Desk, slow_disk: Event
) -> None:
    for name in ("T-11", "T-12"):
        keep_and_leave(desk, name)
    slow_disk.set()
    desk.settle()

    assert list(desk.library.tips) == ["T-11", "T-12"]


def test_why_a_change_was_not_kept_is_reported_though_the_dialog_was_left(
    desk: Desk, slow_disk: Event
) -> None:
    keep_and_leave(desk, "T-11")
    add_item(desk.data, ListedTip(id="T-11"), ANN, local_now())
    slow_disk.set()
    desk.settle()

    assert "The tip T-11 is in the library already." in desk.reported[-1]


def test_what_makes_no_sense_is_reported_in_the_dialog_and_nothing_is_kept(
    desk: Desk,
) -> None:
    desk.add(TIP)
    desk.names.library_requested.emit(ItemKind.TIP)
    desk.click("Add...")
    desk.enter("ID (as on label)", "t-7")
    desk.enter("Expiry date", "soon")
    assert not desk.control("Save").isEnabled()
    desk.enter("Expiry date", "2031-02-03")
    desk.click("Save")
    desk.settle()

    assert len(library_files(desk.data)) == 1
    assert desk.control(
        "The tip T-7 is in the library already. Edit that item, or choose another ID."
    )
    desk.click("Cancel")
    desk.click("Close")


def test_a_tip_is_retired_and_brought_back_with_a_reason(desk: Desk) -> None:
    desk.add(TIP)
    desk.names.library_requested.emit(ItemKind.TIP)
    desk.click("Retire...")
    desk.enter("Reason for change", "chipped")
    desk.click("Save")
    desk.settle()
    assert desk.library.tips["T-7"].is_retired
    assert not desk.rows

    box = desk.control("Show retired items")
    assert isinstance(box, QAbstractButton)
    box.click()
    assert desk.rows[0][:2] == ("T-7", "RETIRED")
    desk.click("Reactivate...")
    desk.click("Save")
    desk.settle()
    assert not desk.library.tips["T-7"].is_retired
    desk.click("Close")


@pytest.mark.slow
def test_where_a_password_guards_a_supervisor_signs(desk: Desk) -> None:
    eve = Signature("Eve", "correct horse")
    set_password(desk.data, eve, eve.password, local_now())
    desk.workbench.selection.set_supervision(desk.workbench.run.archive.supervision())

    desk.names.library_requested.emit(ItemKind.CONE)
    desk.click("Add...")
    desk.enter("ID (as on label)", "C-5")
    assert not desk.control("Save").isEnabled()
    desk.enter("Supervisor", "Eve")
    desk.enter("Supervisor password", eve.password)
    desk.click("Save")
    desk.settle()
    ((_, change),) = library_changes(desk.data)
    assert (change.item.id, change.supervisor) == ("C-5", "Eve")
    desk.click("Close")


# Barcodes


def test_a_tip_that_is_scanned_again_keeps_what_the_library_does_not_tell(
    desk: Desk,
) -> None:
    desk.add(ListedTip(id="T-8"))
    desk.scan("T-8")
    desk.enter("Ball diameter", "4.5")
    QTest.keyClick(desk.control("Ball diameter"), Qt.Key.Key_Return)
    desk.scan("T-8")

    assert desk.workbench.selection.preparation.names.ball_diameter == 4.5

    desk.list_of(ItemKind.TIP).menu().actions()[0].trigger()

    assert desk.workbench.selection.preparation.names.ball_diameter == 4.5
    assert desk.text_of("Ball diameter") == "4.5000 mm"

    desk.add(TIP)
    desk.scan("T-7")
    desk.scan("T-8")

    assert desk.workbench.selection.preparation.names.ball_diameter is None


def test_an_unknown_barcode_is_offered_to_be_added(desk: Desk) -> None:
    desk.scan("T-77")
    questions = desk.page.findChildren(QuestionBar)
    assert any(each.isVisible() for each in questions)
    desk.click("Add tip")

    assert desk.text_of("ID (as on label)") == "T-77"
    desk.click("Save")
    desk.settle()
    assert "T-77" in desk.library.tips
    desk.click("Close")


def test_an_unknown_barcode_that_is_not_added_leaves_no_other_tip_chosen(
    desk: Desk,
) -> None:
    assert desk.workbench.selection.preparation.names.tip == "T-10"
    desk.scan("T-77")
    desk.click("Not now")

    chosen = desk.workbench.selection.preparation
    assert chosen.names.tip == ""
    assert tip_details(chosen, desk.workbench.library.statuses) == ""
    assert desk.text_of("Probe tip") == ""
    assert desk.page.main_action().why_not


def test_the_barcode_of_a_retired_tip_chooses_nothing(desk: Desk) -> None:
    desk.add(TIP)
    retire_item(desk.data, ItemKind.TIP, "T-7", ANN, local_now())
    desk.workbench.library.refresh()
    desk.settle()
    desk.scan("T-7")

    assert desk.workbench.selection.preparation.names.tip != "T-7"
    assert desk.reported[-1].startswith("Tip T-7 is retired")


def test_an_unknown_barcode_is_asked_about_no_more_once_its_tip_is_there(
    desk: Desk,
) -> None:
    desk.scan("T-7")
    question = desk.page.findChild(QuestionBar)
    assert isinstance(question, QuestionBar)
    assert question.words() == "Tip T-7 is not in the tip library. Add it?"

    desk.add(TIP)

    assert question.words() == ""


def test_a_new_item_is_typed_at_once_and_the_dialog_stays_as_wide(desk: Desk) -> None:
    desk.add(TIP)
    desk.names.library_requested.emit(ItemKind.TIP)
    desk.settle()
    desk.dialog.resize(1000, 500)

    with desk.qtbot.waitActive(desk.dialog):
        desk.dialog.activateWindow()
    desk.click("Add...")
    QTest.keyClicks(desk.dialog.focusWidget(), "T-11")
    assert desk.text_of("ID (as on label)") == "T-11"

    QTest.keyClick(desk.dialog.focusWidget(), Qt.Key.Key_Escape)
    desk.settle()
    assert desk.dialog.isVisible()
    assert desk.dialog.width() == 1000
