"""The LED file belongs to the pen: chosen with it, stored with it, asked for."""

import os
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest
from msgspec import structs
from PySide6.QtCore import QCoreApplication, QThreadPool

from lightpen.formats.opened_files import PenFile
from lightpen.record.library.library_changes import Author, change_item
from lightpen.record.library.tip_library import LedFile, ListedPen, read_library
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.work.workbench import Workbench

ANN = Author("Hall 2", "Ann")


class Bench:
    """A workbench whose images are of a real pen."""

    def __init__(self, workbench: Workbench, folder: Path) -> None:
        self.workbench, self.folder = workbench, folder
        self.pens, self.selection = workbench.pens, workbench.selection
        self.reported: list[str] = []
        workbench.notifications.raised.connect(lambda text: self.reported.append(text))
        source = SourceChoice(SourceKind.RECORDED, str(folder))
        now = self.selection.preparation.with_source(source)
        self.selection.set_preparation(now)

    def settle(self) -> None:
        """Let jobs end, and those that they began."""
        for _ in range(4):
            QThreadPool.globalInstance().waitForDone()
            QCoreApplication.processEvents()

    def file(self, name: str, x: float = 25.0) -> PenFile:
        """Write the file of a pen of which LED 8 is at some place."""
        rows = [
            *("1,0,0,0", "2,0,20,0", "3,0,40,0", "4,0,60,0", "5,-25,10,0"),
            *("6,25,10,0", "7,-25,35,0", f"8,{x},35,0", "9,-25,60,0", "10,25,60,0"),
        ]
        path = self.folder / name
        path.write_text("\n".join(["led,x_mm,y_mm,z_mm", *rows]) + "\n")
        return PenFile.read(path)

    def open(self, file: PenFile) -> None:
        """Use a file for the pen that is chosen, as the step LEDs does."""
        now = self.selection.preparation
        self.selection.set_preparation(replace(now, pen_file=file))
        self.pens.keep(file)
        self.settle()

    def choose(self, pen: str) -> None:
        now = self.selection.preparation
        names = replace(now.names, pen=pen)
        self.selection.set_preparation(replace(now, names=names))
        self.settle()

    @property
    def path(self) -> Path | None:
        file = self.selection.preparation.pen_file
        return None if file is None else file.path


@pytest.fixture
def bench(workbench: Workbench, tmp_path: Path) -> Iterator[Bench]:
    folder = tmp_path / "pens"
    folder.mkdir()
    yield Bench(workbench, folder)
    QThreadPool.globalInstance().waitForDone()


def test_a_pen_without_a_file_does_not_keep_that_of_another(bench: Bench) -> None:
    bench.open(bench.file("04.csv"))

    bench.choose("LP-05")

    assert bench.path is None
    assert bench.selection.preparation.leds_missing_inputs()


def test_each_pen_is_chosen_with_its_own_file(bench: Bench) -> None:
    one, other = bench.file("04.csv"), bench.file("05.csv", x=25.1)
    bench.open(one)
    bench.choose("LP-05")
    bench.open(other)

    bench.choose("LP-04")
    assert bench.path == one.path
    bench.choose("LP-05")
    assert bench.path == other.path
    stored = read_library(bench.workbench.folder).pens["LP-04"].led_file
    assert stored == LedFile(str(one.path), one.sha256)
    assert bench.pens.doubt() == ""


def test_the_file_of_another_pen_is_doubted(bench: Bench) -> None:
    one = bench.file("04.csv")
    bench.open(one)
    bench.choose("LP-05")

    words = "04.csv is the LED file of pen LP-04, not of pen LP-05."
    assert bench.pens.doubt_about(one) == words


def test_another_file_of_the_same_pen_is_doubted_until_it_is_stored(
    bench: Bench,
) -> None:
    bench.open(bench.file("04.csv"))
    newer = bench.file("newer.csv", x=25.1)
    words = "newer.csv is not the LED file stored with pen LP-04 (04.csv)."
    assert bench.pens.doubt_about(newer) == words

    bench.open(newer)

    assert bench.pens.doubt() == ""


def test_files_of_the_same_name_are_told_apart_by_folder_and_date(bench: Bench) -> None:
    one = bench.file("04.csv")
    bench.open(one)
    (one.path.parent / "old").mkdir()
    other = bench.file("old/04.csv", x=25.1)
    moment = datetime(2026, 3, 1, 12, 30).timestamp()
    os.utime(other.path, (moment, moment))
    moment += 24 * 3600
    os.utime(one.path, (moment, moment))

    assert bench.pens.doubt_about(other) == (
        f"{other.path} of 2026-03-01 12:30 is not the LED file stored with pen LP-04 "
        f"({one.path} of 2026-03-02 12:30)."
    )


def test_a_file_that_was_changed_since_is_not_used(bench: Bench) -> None:
    bench.open(bench.file("04.csv"))
    bench.choose("LP-05")
    bench.file("04.csv", x=25.1)

    bench.choose("LP-04")

    assert bench.path is None
    assert "was changed since it was stored with pen LP-04" in bench.reported[-1]


def test_a_pen_brings_its_expansion(bench: Bench) -> None:
    bench.open(bench.file("04.csv"))
    data, now = bench.workbench.folder, bench.workbench.around.now()
    pen: ListedPen = read_library(data).pens["LP-04"]
    change_item(data, structs.replace(pen, expansion=23e-6), ANN, now)
    bench.workbench.library.refresh()
    bench.settle()
    bench.choose("LP-05")
    bench.choose("LP-04")

    assert bench.selection.preparation.assumptions.expansion == 23e-6


def test_a_simulated_pen_keeps_its_files_under_any_name(workbench: Workbench) -> None:
    before = workbench.selection.preparation
    names = replace(before.names, pen="LP-05")
    workbench.selection.set_preparation(replace(before, names=names))

    assert workbench.selection.preparation.pen_file is before.pen_file
    assert workbench.pens.doubt() == ""
