"""Interrupted swings and verifications at the step Start, to resume or discard.

One that another program captures, or that is damaged, is reported and not offered.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias, TypeVar

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QGroupBox, QWidget
from typing_extensions import override

from lightpen.messages import printable
from lightpen.record.results.acceptance import conclude_accepted
from lightpen.record.results.result_folder import swing_folder
from lightpen.record.swings.interrupted import (
    DamagedSwing,
    InterruptedSwings,
    discard_damaged,
    discard_swing,
    find_unfinished,
)
from lightpen.record.swings.reading import Record
from lightpen.swing.swing_recorder import Resumable, read_resumable
from lightpen_app.face import InterruptedWork, RowWords, Services
from lightpen_app.look.languages import listed, worded
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.phrases import missing_input_text, n_images_text, origin_text
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import PARTED, breakable, moment_text, shortened, unbroken
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import PageScroll
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_app.work.workbench import Workbench

T = TypeVar("T")
Found: TypeAlias = tuple[InterruptedSwings, tuple[InterruptedWork, ...]]
N_ROWS_SEEN = 2  # the others are scrolled to
NOTICE = "start"  # cause of its notifications
LONGEST = 16  # characters of a name


@dataclass(frozen=True, eq=False)
class InterruptedEntry:
    """Interrupted work, and what can be done with it; None where it cannot."""

    words: RowWords
    resume: Callable[[], object] | None
    discard: Callable[[], object] | None
    is_damaged: bool = False


class InterruptedRow(Translated, QFrame):
    """Interrupted work with its buttons."""

    discard_requested = Signal()

    def __init__(self, entry: InterruptedEntry) -> None:
        super().__init__()
        words = entry.words

        # Widgets
        self._when = text_label(TextSize.BODY)
        self._when.setText(words.heading)
        self._what = text_label(TextSize.SMALL, Tone.QUIET)
        self._what.setText(words.description)
        self._resume = self.make_button(words.resume[0], entry.resume or bool)
        self._discard = self.make_button(words.discard[0], self.discard_requested)
        self.say(self._resume, name=words.resume[1].format(words.heading))
        self.say(self._discard, name=words.discard[1].format(words.heading))

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        horizontal_layout(layout, (self._when, 1), self._resume, self._discard)
        layout.addWidget(self._what, 1, Qt.AlignmentFlag.AlignTop)

        self._resume.setVisible(entry.resume is not None)
        self._discard.setVisible(entry.discard is not None)
        if entry.is_damaged:
            set_tone(self._when, Tone.BAD)

    def words(self) -> tuple[str, str]:
        """Return the texts of the row."""
        return self._when.text(), unbroken(self._what.text())

    def height_for(self, width: int) -> int:
        """Return the height of the row that shows its text completely, px."""
        for each in self.findChildren(QWidget):
            each.ensurePolished()  # its font is known only then
        return self.heightForWidth(width)

    def set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none."""
        self._resume.set_why_not(why)
        self._discard.set_why_not(why)


class InterruptedPanel(Translated, QGroupBox):
    """Lists swings and other work that have no end; hidden while there are none.

    Resumes, shows, closes or discards it. ``settle`` takes over what is being typed on
    the page.
    """

    step_requested = Signal(str)  # key of the step that shows the resumed swing

    def __init__(
        self, workbench: Workbench, services: Services, settle: Callable[[], None]
    ) -> None:
        super().__init__()
        self._selection, self._camera = workbench.selection, workbench.camera
        self._run, self._services = workbench.run, tuple(services)
        self._notices = workbench.notifications
        self._live, self._archive_writer = workbench.live, workbench.archive_writer
        self._settle = settle
        self._search = LatestJob(self)
        self._work: Job | None = None
        self._resumed: Path | None = None
        self._reviewed: Path | None = None
        self._is_continuing = False
        self._searching = QTimer(self, singleShot=True)
        self._rows: list[InterruptedRow] = []
        self._why_waiting = ""

        # Widgets
        self._hint = self.say(
            text_label(TextSize.SMALL, Tone.QUIET),
            self.tr("A resumed swing keeps its images and its files."),
        )
        self._scroll = PageScroll()
        self._scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._question = QuestionBar()
        self._again = self.make_button(self.tr("Search again"), self._search_now)

        # Layout
        left = Qt.AlignmentFlag.AlignLeft
        vertical_layout(
            self, self._hint, self._scroll, self._question, (self._again, 0, left)
        )

        # Connections
        self._searching.timeout.connect(self._search_now)
        workbench.run.open_requested.connect(self._on_swing_wanted)
        workbench.run.changed.connect(self._on_run_changed)
        workbench.run.refused.connect(self._on_run_refused)
        for each in services:
            each.resumed.connect(self._on_work_resumed)
            each.refused.connect(self._on_work_refused)

        self.hide()

    def search(self) -> None:
        """Search for interrupted swings and other work in the background."""
        self._searching.start()

    def shut_down(self) -> None:
        """Cancel running jobs."""
        self._searching.stop()
        self._search.cancel()
        if self._work is not None:
            self._work.cancel()

    def _search_now(self) -> None:
        run, services = self._run, self._services
        archive, folder = run.archive, run.records_folder

        def search(_: Report) -> Found:
            swings = conclude_accepted(archive, find_unfinished(folder))
            works = (work for each in services for work in each.find_interrupted())
            return swings, tuple(works)

        self._search.start(search, self._on_found, self._show_fault)

    def _on_found(self, found: Found) -> None:
        (swings, works), present = found, self._run.status.record_folder
        if self._work is None and not self._is_continuing:
            self._set_waiting("")
        offered = (each for each in swings.interrupted if each.folder != present)
        others = (each for each in swings.under_way if each.folder != present)
        entries = (
            *map(self._work_entry, works),
            *map(self._swing_entry, offered),
            *map(self._other_entry, others),
            *map(self._damaged_entry, swings.damaged),
        )
        self._set_entries(entries)

    def _set_entries(self, entries: Sequence[InterruptedEntry]) -> None:
        self._question.hide()
        self._rows = [self._row(entry) for entry in entries]
        content = QWidget()
        vertical_layout(content, *self._rows, 1, margins=(0, 0, GRID, 0))
        self._scroll.setWidget(content)
        self._hint.setVisible(any(each.resume for each in entries))
        self._again.setVisible(not all(each.resume for each in entries))
        self._set_waiting(self._why_waiting)
        self.setTitle(self.tr("Interrupted: {0}").format(len(entries)))
        self.setVisible(bool(entries))
        self._hold_rows()

    def _row(self, entry: InterruptedEntry) -> InterruptedRow:
        row = InterruptedRow(entry)
        row.discard_requested.connect(lambda: self._ask(entry))
        return row

    def _ask(self, entry: InterruptedEntry) -> None:
        """Ask below the rows, so that a double click discards nothing."""
        words = entry.words
        asked = f"{words.heading}: {words.question}"
        question = Question(asked, words.discard[0], self.tr("Keep"))
        self._question.ask_about(lambda: question, entry.discard or bool)

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._hold_rows()

    def _hold_rows(self) -> None:
        """Keep the first rows fully visible, however their text wraps."""
        width = self._scroll.viewport().width() - GRID
        heights = (row.height_for(width) + GRID for row in self._rows[:N_ROWS_SEEN])
        self._scroll.setFixedHeight(sum(heights))

    def _set_waiting(self, why: str) -> None:
        """Disable the buttons for a reason, or enable them for none."""
        self._why_waiting = why
        for row in self._rows:
            row.set_waiting(why)

    @override
    def _refresh(self) -> None:
        if self._rows:
            self._search_now()  # what is found is worded anew

    def _work_entry(self, work: InterruptedWork) -> InterruptedEntry:
        close = partial(self._on_close_requested, work)
        resume = partial(self._on_continue_requested, work)
        is_damaged = work.names is None
        return InterruptedEntry(
            work.words(), None if is_damaged else resume, close, is_damaged=is_damaged
        )

    def _swing_entry(self, record: Record) -> InterruptedEntry:
        names, folder = record.header.names, record.folder
        called = (shortened(name, LONGEST) for name in (names.pen, names.tip))
        parts = (*called, n_images_text(len(record.images)))
        text = PARTED.join(filter(None, parts))
        return InterruptedEntry(
            self._row_words(moment_text(record.header.created), text),
            lambda: self._on_resume_requested(folder),
            lambda: self._on_discard_requested(folder, discard_swing),
        )

    def _other_entry(self, record: Record) -> InterruptedEntry:
        heading = moment_text(record.header.created)
        words = self._row_words(heading, self.tr("In use by another program"))
        return InterruptedEntry(words, None, None)

    def _damaged_entry(self, swing: DamagedSwing) -> InterruptedEntry:
        heading = self.tr("Damaged: {0}").format(shortened(swing.folder.name))
        words = self._row_words(heading, breakable(worded(swing.message)))
        discard = partial(self._on_discard_requested, swing.folder, discard_damaged)
        return InterruptedEntry(words, None, discard, is_damaged=True)

    def _row_words(self, heading: str, description: str) -> RowWords:
        return RowWords(
            heading,
            description,
            self.tr("Discard this swing? Its images remain on the disk."),
            (self.tr("Resume"), self.tr("Resume the swing of {0}")),
            (self.tr("Discard"), self.tr("Discard the swing of {0}")),
        )

    def _work_on(
        self,
        waiting: str,
        function: Callable[[Report], T],
        on_succeeded: Callable[[T], None],
    ) -> None:
        """Apply an action to an item; the list is disabled until it ends."""
        self._set_waiting(waiting)
        self._work = Job(function, self)
        self._work.start(
            on_succeeded,
            self._on_work_failed,
            crashed=self._on_work_crashed,
            ended=partial(self._on_work_ended, self._work),
        )

    def _show_fault(self, sentence: str) -> None:
        self._notices.notify(NOTICE, sentence)

    def _on_work_failed(self, sentence: str) -> None:
        self._show_fault(sentence)
        self._on_work_crashed()

    def _on_work_crashed(self) -> None:
        self._set_waiting("")
        self._search_now()

    def _on_work_ended(self, work: Job) -> None:
        if work is self._work:
            self._work = None

    # Swings

    def _on_resume_requested(self, folder: Path) -> None:
        self._work_on(
            self.tr("Reading the swing"),
            lambda _: read_resumable(folder),
            self._on_swing_read,
        )

    def _on_swing_wanted(self, path: Path) -> None:
        self._work_on(
            self.tr("Reading the swing"),
            lambda _: read_resumable(swing_folder(path)),
            self._on_wanted_read,
        )

    def _on_wanted_read(self, swing: Resumable) -> None:
        """Resume an interrupted swing; show the tip of one that has a verdict."""
        if swing.record.verdict is None:
            self._on_swing_read(swing)
            return
        self._set_waiting("")
        self._take_over(swing)
        self._reviewed = swing.record.folder
        runner = self._run.runner
        runner.ask(lambda workflow: workflow.continue_swing(swing))
        runner.ask(lambda workflow: workflow.finish())

    def _on_swing_read(self, swing: Resumable) -> None:
        self._set_waiting("")
        self._take_over(swing)
        live = self._live
        if not live.is_open:
            self._camera.open()
        size = self._selection.preparation.image_size
        if not live.is_open:
            self._notices.notify(
                self,
                self.tr(
                    "No camera is open. Choose the image source of this swing at "
                    "the step Camera: {0}. Then resume the swing here."
                ).format(_source_text(swing)),
            )
        elif not swing.is_of(self._selection.preparation.sources):
            self._notices.notify(
                self,
                self.tr(
                    "The swing was captured with another image source: {0}. Choose "
                    "that source at the step Camera, then resume the swing here."
                ).format(_source_text(swing)),
            )
        elif size is not None and not swing.fits(size):
            camera = swing.setup.camera
            self._notices.notify(
                self,
                self.tr(
                    "The image size is {0} x {1} px; the swing was captured with "
                    "{2} x {3} px. Choose its camera at the step Camera, then "
                    "resume the swing here."
                ).format(*size, *camera.image_size),
            )
        else:
            self._resumed = swing.record.folder
            self._run.runner.ask(lambda workflow: workflow.continue_swing(swing))

    def _take_over(self, swing: Resumable) -> None:
        """Select the item of the swing, its station and, if others are, its sources."""
        selection, header = self._selection, swing.record.header
        station = selection.preparation.names.station
        self._go_to_station(header.names.station)
        names = swing.record.header.names
        names = replace(names, station=names.station or station)
        now = replace(
            selection.preparation, names=names, nominal_tip=header.nominal_tip
        )
        sources = swing.source_choices
        if sources and not swing.is_of(now.sources):
            now = now.with_source(sources[0])
            now = now.with_second(next(iter(sources[1:]), None))
        if now.second is not None and now.rig_file is None:
            now = now.with_rig(swing.rig_file)
        selection.set_preparation(now)

    def _go_to_station(self, name: str) -> None:
        """Restore the last selection of a known station."""
        selection = self._selection
        is_other = name != selection.preparation.names.station
        if is_other and name in selection.stations():
            selection.choose_station(name)

    def _on_run_changed(self) -> None:
        status = self._run.status
        if status.solution is not None and status.record_folder == self._reviewed:
            self._reviewed = None
            self.step_requested.emit("review")
        if self._resumed is not None and status.record_folder == self._resumed:
            self._resumed = None
            self.step_requested.emit("swing")

    def _on_run_refused(self) -> None:
        self._resumed = self._reviewed = None

    def _on_discard_requested(
        self, folder: Path, discard: Callable[[Path], None]
    ) -> None:
        def leave(_: Report) -> Path:
            discard(folder)
            return folder

        waiting = self.tr("Discarding the swing")
        self._work_on(waiting, leave, self._on_discarded)

    def _on_discarded(self, folder: Path) -> None:
        self._notices.show_status(
            self.tr("Swing discarded. The images remain in {0}.").format(folder)
        )
        self._search_now()

    # Work of extensions

    def _on_continue_requested(self, work: InterruptedWork) -> None:
        """Select the item of the work and resume it."""
        selection = self._selection
        if work.names is None:
            return
        self._settle()
        self._go_to_station(work.names.station)
        selection.set_preparation(replace(selection.preparation, names=work.names))
        missing_inputs = selection.preparation.missing_inputs()
        if missing_inputs:
            self._notices.notify(NOTICE, missing_input_text(missing_inputs[0]))
            return
        self._is_continuing = True
        self._set_waiting(work.resume())

    def _on_work_resumed(self, key: str) -> None:
        self._on_work_refused()
        self.step_requested.emit(key)

    def _on_work_refused(self) -> None:
        if self._is_continuing:
            self._is_continuing = False
            self._set_waiting("")

    def _on_close_requested(self, work: InterruptedWork) -> None:
        def show(_: None) -> None:
            self._archive_writer.enter_owed()
            self._notices.show_status(work.closed_text())
            self._search_now()

        self._work_on(work.closing_text(), lambda _: work.close(), show)


def _source_text(swing: Resumable) -> str:
    """Return the sources of a swing's images and their locations."""
    choices = swing.source_choices
    if not choices:
        return origin_text(swing.record.header.origin)
    pairs = [(worded(each.source.name), printable(each.place)) for each in choices]
    return listed(text for each in pairs for text in each if text)
