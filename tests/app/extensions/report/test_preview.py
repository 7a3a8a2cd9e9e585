"""What is shown is what is saved and printed."""

from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event, current_thread, main_thread
from typing import Any

import pytest
from PySide6.QtCore import Qt, QThreadPool
from PySide6.QtPrintSupport import QPrinter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QGraphicsView, QPushButton
from pytestqt.qtbot import QtBot
from shiboken6 import isValid
from tests.app.patience import PATIENCE_MS

from lightpen.record.results.results import Result
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.report.control import PrintReportWindow
from lightpen_app_extensions.report.pages import (
    PrintReport,
    lay_out,
    paint_on,
    paint_page,
)


@pytest.fixture
def window(
    workbench: Workbench, result: Result, printed: Callable[..., PrintReport]
) -> Iterator[PrintReportWindow]:
    window = PrintReportWindow(printed(result), workbench.save_place, "tip")
    window.show()
    yield window
    QThreadPool.globalInstance().waitForDone()
    QApplication.processEvents()  # what a job tells at its end
    if isValid(window):
        window.close()


def test_escape_closes_it_and_nothing_is_scrolled_to_the_sides(
    qtbot: QtBot, window: PrintReportWindow
) -> None:
    qtbot.waitUntil(lambda: window._pages.pageCount() > 1)
    pages = window.findChild(QGraphicsView)
    assert pages is not None
    assert pages.horizontalScrollBar().maximum() == 0

    with qtbot.waitActive(window):
        window.activateWindow()
    QTest.keyClick(window, Qt.Key.Key_Escape)

    assert not window.isVisible()


def said(window: PrintReportWindow) -> str:
    (label,) = window.findChildren(SignLabel)
    return label.value().text


def _save_button(window: PrintReportWindow) -> QPushButton:
    buttons = window.findChildren(QPushButton)
    (button,) = (each for each in buttons if each.text() == "Save as PDF...")
    return button


def test_it_is_saved_where_it_is_wanted(
    qtbot: QtBot, window: PrintReportWindow, tmp_path: Path
) -> None:
    path = tmp_path / "record.pdf"
    _save_button(window).click()
    (dialog,) = window.findChildren(QFileDialog)

    with qtbot.waitSignal(window.saved) as saved:
        dialog.fileSelected.emit(str(path))
        dialog.close()

    assert saved.args == [path]
    assert path.read_bytes().startswith(b"%PDF-1.4")
    assert said(window) == f"Saved as {path}"


def test_where_it_cannot_be_saved_is_reported(
    qtbot: QtBot, window: PrintReportWindow, tmp_path: Path
) -> None:
    with qtbot.waitSignal(window.failed) as failed:
        window.write(tmp_path / "no" / "such" / "record.pdf")

    assert "record.pdf" in failed.args[0]
    assert said(window) == failed.args[0]


def test_a_printer_gets_every_page(
    result: Result, printed: Callable[..., PrintReport], tmp_path: Path
) -> None:
    printer = QPrinter(QPrinter.PrinterMode.HighResolution)
    printer.setOutputFormat(QPrinter.OutputFormat.PdfFormat)
    printer.setOutputFileName(str(tmp_path / "printed.pdf"))
    paper = printed(result)

    paint_on(paper, printer)

    pdf = (tmp_path / "printed.pdf").read_bytes()
    assert f"/Count {lay_out(paper.parts).pageCount()}".encode() in pdf


def test_a_window_that_is_closed_while_it_saves_saves_all_the_same(
    qtbot: QtBot, window: PrintReportWindow, tmp_path: Path
) -> None:
    path = tmp_path / "record.pdf"

    with qtbot.waitSignal(window.saved):
        window.write(path)
        window.close()

    assert path.read_bytes().startswith(b"%PDF-1.4")


def test_saving_that_is_cancelled_leaves_the_file_as_it_was(
    qtbot: QtBot,
    window: PrintReportWindow,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    painted, may_go_on = Event(), Event()

    def paint_slowly(*arguments: Any) -> None:
        paint_page(*arguments)
        if current_thread() is not main_thread():
            painted.set()
            may_go_on.wait()

    monkeypatch.setattr("lightpen_app_extensions.report.pages.paint_page", paint_slowly)
    path = tmp_path / "saved" / "record.pdf"
    path.parent.mkdir()
    path.write_text("as before")
    reported: list[object] = []
    window.saved.connect(reported.append)
    window.failed.connect(reported.append)
    (progress,) = window.findChildren(JobProgress)
    window.write(path)
    assert painted.wait(PATIENCE_MS / 1000)

    qtbot.waitUntil(progress.isVisible)
    (cancel,) = progress.findChildren(QPushButton)
    cancel.click()
    may_go_on.set()
    save = _save_button(window)
    qtbot.waitUntil(save.isEnabled)

    assert not progress.isVisible()
    assert [each.name for each in path.parent.iterdir()] == ["record.pdf"]
    assert path.read_text() == "as before"
    assert (reported, said(window)) == ([], "")
    with qtbot.waitSignal(window.saved):
        window.write(path)
    assert path.read_bytes().startswith(b"%PDF-1.4")
