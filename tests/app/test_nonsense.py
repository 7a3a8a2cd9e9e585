"""Nonsense typed into any field of any page or dialog changes no value unseen."""

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractSpinBox, QLineEdit, QWidget
from pytestqt.qtbot import QtBot
from tests.app.test_dialogs_fit import MADE
from tests.app.walks import NAMES, set_up

from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.fields import DateField, PathField
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from tests.app.conftest import Walker

NONSENSE = ("abc", "-", "1e999", "12 miles", "--3", "9" * 30, "1,2,3")


def unseen_changes(root: QWidget) -> list[str]:
    """Return what nonsense does to a field without showing it."""
    assert not root.findChildren(QAbstractSpinBox)  # they clamp without a word
    return [
        f"{type(field).__name__} {field.accessibleName()!r}: {typed!r}"
        for field in root.findChildren(QLineEdit)
        if field.isEnabledTo(root)
        and not field.isReadOnly()
        and not isinstance(field.parent(), PathField)
        for typed in NONSENSE
        if not is_seen(field, typed)
    ]


def is_seen(field: QLineEdit, typed: str) -> bool:
    """Type into a field, and return whether it shows what has become of it."""
    before = field.value() if isinstance(field, NumberField) else None
    field.selectAll()
    QTest.keyClicks(field, typed)
    if isinstance(field, NumberField):
        QTest.keyClick(field, Qt.Key.Key_Return)
        is_marked = field.property("tone") == Tone.BAD.value
        seen = field.text() == typed and is_marked and bool(field.reason())
        seen = seen and field.value() == before
        field.set_value(field.value())
        field.setModified(False)
    elif isinstance(field, DateField):
        seen = field.text() == typed and field.property("tone") == Tone.BAD.value
    else:
        seen = field.text() in (typed, typed[: field.maxLength()])
    return seen


@pytest.mark.parametrize("name", MADE)
def test_nonsense_in_a_dialog_is_seen(
    qtbot: QtBot, workbench: Workbench, name: str
) -> None:
    dialog = MADE[name](workbench)
    qtbot.addWidget(dialog)
    dialog.show()

    assert unseen_changes(dialog) == []


@pytest.mark.slow
def test_nonsense_on_a_page_is_seen(walker: "Walker") -> None:
    n_numbers = 0
    for index, _ in enumerate(walker.window.pages()):
        walker.window.go_to(index)
        walker.until(lambda: bool(walker.texts()))
        page = walker.window.page()
        n_numbers += len(page.findChildren(NumberField))

        assert unseen_changes(page) == []

    assert n_numbers > 20


def camera_fields(walker: "Walker") -> Iterator[PathField]:
    """Yield the paths of one camera, then those of two."""
    page = walker.window.page()
    yield from page.findChildren(PathField)
    walker.click("Use a second camera")
    yield from page.findChildren(PathField)


@pytest.mark.slow
@pytest.mark.parametrize("typed", NONSENSE)
def test_a_path_that_is_nonsense_is_marked_and_replaces_nothing(
    walker: "Walker", typed: str
) -> None:
    set_up(walker)
    for name, text in NAMES.items():
        walker.click_into(name, text)
    selection, n_typed = walker.workbench.selection, Counter[str]()

    def type_into(field: PathField) -> None:
        edit, before = field.edit, selection.preparation
        edit.selectAll()
        QTest.keyClicks(edit, typed)
        QTest.keyClick(edit, Qt.Key.Key_Return)
        n_typed[edit.accessibleName()] += 1

        walker.until(lambda: edit.property("tone") == Tone.BAD.value)
        now = selection.preparation
        assert edit.text() == typed
        assert (now.camera_file, now.pen_file, now.rig_file) == (
            *(before.camera_file, before.pen_file, before.rig_file),
        )

    walker.click("Continue to the camera")
    walker.tab_to("Image source")
    walker.press(Qt.Key.Key_Down)
    walker.until_says("Live")
    walker.click("Use its files")
    walker.until(walker.main_button().isEnabled)
    walker.click("Continue to the LEDs")
    walker.until_shows("LEDs")
    (field,) = walker.window.page().findChildren(PathField)
    type_into(field)
    recorded = SourceChoice(SourceKind.RECORDED)
    selection.set_preparation(selection.preparation.with_source(recorded))
    walker.window.show_step("camera")
    for field in camera_fields(walker):
        if field.isVisible():
            type_into(field)
    of_producer = SourceChoice("genicam")
    selection.set_preparation(selection.preparation.with_source(of_producer))
    for field in walker.window.page().findChildren(PathField):
        if field.isVisible() and field.edit.accessibleName() == "GenTL producer":
            type_into(field)

    assert n_typed == {
        "LED file": 1,
        "GenTL producer": 1,
        "Intrinsics file": 1,
        "Rig file": 1,
        "Folder, record or video": 3,
    }
