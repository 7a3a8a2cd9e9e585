"""A path is typed, pasted or picked, and taken over once."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QLineEdit, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from lightpen_app.widgets.fields import PathField


class Form:
    """A path field above another line."""

    def __init__(self, qtbot: QtBot) -> None:
        self.window = QWidget()
        qtbot.addWidget(self.window)
        self.field = PathField()
        self.other = QLineEdit()
        layout = QVBoxLayout(self.window)
        layout.addWidget(self.field)
        layout.addWidget(self.other)
        self.taken: list[str] = []
        self.field.value_changed.connect(self.taken.append)
        self.window.show()
        self.window.activateWindow()
        self.field.edit.setFocus()

    def type(self, text: str) -> None:
        QTest.keyClicks(self.field.edit, text)

    def press(self, key: Qt.Key) -> None:
        QTest.keyClick(self.field.edit, key)


@pytest.fixture
def form(qtbot: QtBot) -> Form:
    return Form(qtbot)


def test_enter_takes_a_path_over(form: Form) -> None:
    form.type("/data/camera.yaml")
    assert form.taken == []

    form.press(Qt.Key.Key_Return)

    assert form.taken == ["/data/camera.yaml"]
    assert form.field.value() == "/data/camera.yaml"


def test_leaving_the_field_takes_a_path_over_once(form: Form) -> None:
    form.type("/data/camera.yaml")
    form.press(Qt.Key.Key_Tab)
    form.other.clearFocus()
    form.field.edit.setFocus()
    form.press(Qt.Key.Key_Tab)

    assert form.taken == ["/data/camera.yaml"]


def test_enter_takes_a_faulty_path_again_and_no_other(form: Form) -> None:
    form.field.set_value("/data/camera.yaml")

    form.press(Qt.Key.Key_Return)
    assert form.taken == []  # it is the window's

    form.field.set_faulty(True)
    form.press(Qt.Key.Key_Return)
    assert form.taken == ["/data/camera.yaml"]


@pytest.mark.parametrize(
    ("typed", "path"),
    [
        ('"/data/my camera.yaml"', "/data/my camera.yaml"),
        ("'/data/camera.yaml' ", "/data/camera.yaml"),
        ("/data/Ann's", "/data/Ann's"),
        ('"', '"'),
        ("~/camera.yaml", str(Path.home() / "camera.yaml")),
    ],
)
def test_a_path_is_taken_as_a_desktop_copies_it(
    form: Form, typed: str, path: str
) -> None:
    form.type(typed)
    form.press(Qt.Key.Key_Return)

    assert form.taken == [path]


def test_the_dialog_begins_where_the_path_leads(form: Form, tmp_path: Path) -> None:
    file = tmp_path / "camera.yaml"
    file.touch()
    form.field.set_value(str(file))

    form.field.pick(QFileDialog.FileMode.ExistingFile, "Camera", "Files (*.yaml)")
    dialog = form.field.findChild(QFileDialog)
    assert isinstance(dialog, QFileDialog)

    assert Path(dialog.directory().absolutePath()) == tmp_path
    dialog.selectFile(str(file))
    dialog.accept()
    assert form.taken == [str(file)]


def test_the_dialog_begins_where_the_last_file_was_once_the_path_is_gone(
    form: Form, tmp_path: Path
) -> None:
    form.field.set_value(str(tmp_path / "camera.yaml"))
    form.field.set_value("")

    form.field.pick(QFileDialog.FileMode.ExistingFile, "Camera", "Files (*.yaml)")
    dialog = form.field.findChild(QFileDialog)
    assert isinstance(dialog, QFileDialog)

    assert Path(dialog.directory().absolutePath()) == tmp_path
    dialog.reject()
