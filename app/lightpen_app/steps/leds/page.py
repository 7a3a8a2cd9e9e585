"""The step LEDs: their places on the pen, checked against its frame and live images."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from PySide6.QtCore import QSize
from PySide6.QtGui import QUndoStack
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget
from typing_extensions import override

from lightpen.cameras.worker_events import Connection
from lightpen.formats.opened_files import PenFile
from lightpen.model.pen import Pen
from lightpen.pen_check.draft import DraftCheck, PenDraft, check_draft
from lightpen.pen_check.match import Finding, PenMatch
from lightpen.pen_check.mending import exchanged, leds_to_exchange, mended
from lightpen.pen_check.opening import OpenedPen, open_pen, save_pen
from lightpen.sentences import Sentence
from lightpen.swing.preparation import SourceKind
from lightpen_app.look.phrases import lack_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID
from lightpen_app.steps.leds.draft_edit import DraftEdit
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.steps.leds.frame_panel import FramePanel
from lightpen_app.steps.leds.hand_row import HandRow
from lightpen_app.steps.leds.match_panel import MatchPanel
from lightpen_app.steps.leds.match_watch import PenWatch
from lightpen_app.steps.leds.pen_view import PenPicture
from lightpen_app.steps.leds.table_panel import Changes, LedTablePanel
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.widgets.page_scroll import PageScroll, Squeezed
from lightpen_app.widgets.rearranged import Rearranged
from lightpen_app.widgets.undo_buttons import UndoButtons
from lightpen_app.work.job import Job, Report
from lightpen_app.work.live_view import Shown
from lightpen_app.work.workbench import Workbench

T = TypeVar("T")

SHARES, VAST_SHARES = (40, 29, 31), (26, 32, 42)  # of table, pen in space and image


class LedsPage(Rearranged, Page):
    """Opens, shows, mends and saves the LED file.

    The table shows a draft. The live match follows it at once; a swing needs a file, so
    a draft that differs from the file in use has to be saved before the next step.
    """

    key = "leds"
    shows_images = True
    narrow_below = 110 * GRID  # px; then two panels are side by side, not three
    low_below = 62 * GRID  # px; then it scrolls
    vast_from = QSize(240 * GRID, 130 * GRID)  # px; then the live image is larger

    def __init__(self, workbench: Workbench, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._is_shown = False
        self._in_use: PenFile | None = None
        self._draft = self._opened = PenDraft()
        self._is_foreign = False  # opened from a file that cannot be used
        self._check = DraftCheck()
        self._job: Job | None = None
        self._problem: Callable[[], str] = self._frame_error
        self._edits = QUndoStack(self)

        # Widgets
        self._file = LedFilePanel()
        self._table = LedTablePanel(UndoButtons(self._edits, self))
        self._space = FramePanel()
        self._hand = HandRow(workbench.live)
        self._match = MatchPanel(self._hand)
        self._watch = PenWatch(self)

        # Layout
        self._content = Squeezed()
        self._rows = QVBoxLayout(self._content)
        self._rows.setContentsMargins(0, 0, 0, 0)
        self._rows.setSpacing(2 * GRID)
        self._panels = panels = QHBoxLayout()
        panels.setSpacing(2 * GRID)
        panels.addWidget(self._table)
        self._use_room()
        panels.addWidget(self._match)
        self._share_room()
        self._rows.addWidget(self._file)
        self._rows.addLayout(panels, 1)
        scroll = PageScroll()
        scroll.setWidget(self._content)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scroll)

        # Connections
        self._file.path_chosen.connect(self._on_path_chosen)
        self._file.units_chosen.connect(self._on_units_chosen)
        self._file.save_chosen.connect(self._on_save_chosen)
        self._file.samples_requested.connect(self._on_samples_requested)
        self._file.exchange_requested.connect(self._on_exchange_requested)
        self._table.value_changed.connect(self._edit)
        self._table.discard_requested.connect(self._on_discard_requested)
        self._table.led_chosen.connect(self._space.view().set_chosen)
        self._space.led_chosen.connect(self._table.set_chosen)
        self._space.move_requested.connect(self._on_move_requested)
        self._match.mend_requested.connect(self._on_mend_requested)
        self._watch.value_changed.connect(self._on_match_changed)
        self._workbench.changed.connect(self._on_workbench_changed)
        self._workbench.station_left.connect(self._drop_job)
        self._workbench.live.image_shown.connect(self._on_image_shown)
        self._workbench.live.connection_changed.connect(self._on_connection_changed)
        self._workbench.live.other_changed.connect(self._on_connection_changed)

        self._on_workbench_changed()

    @override
    def title(self) -> str:
        return self.tr("LEDs")

    @override
    def lead(self) -> str:
        if self._workbench.preparation.source.kind == SourceKind.RECORDED:
            return self.tr(
                "Open the file of this pen's LEDs; it is compared with what the "
                "recorded images show."
            )
        return self.tr(
            "Open the file of this pen's LEDs and hold the pen before the camera."
        )

    @override
    def is_complete(self) -> bool:
        return not self._workbench.preparation.leds_lacks()

    @override
    def why_closed(self) -> str:
        preparation = self._workbench.preparation
        for lack in preparation.start_lacks() + preparation.camera_lacks():
            return lack_text(lack)
        return ""

    @override
    def main_action(self) -> MainAction:
        return MainAction(self.tr("Continue to the swing"), self._why_not())

    @override
    def entered(self) -> None:
        self._is_shown = True
        self._match.clear()
        self._watch.start()
        self._workbench.live.show_pen()
        self._aim()
        self._refresh_live()

    @override
    def left(self) -> None:
        self._is_shown = False
        self._watch.stop()
        self._hand.rest()
        if self._is_pending and not self._workbench.run.status.is_capturing:
            self._workbench.live.set_aim(self._workbench.preparation.aim)

    @override
    def unsaved(self) -> str:
        if not self._is_edited:
            return ""
        return self.tr("The LED table has changes that are not saved.")

    @override
    def shut_down(self) -> None:
        self._watch.stop()

    @override
    def _retranslate(self) -> None:
        self._tell(self._problem)
        self._table.set_flaw(worded(self._check.flaw))
        self._table.set_marked(self._match.reasons())
        self._refresh()
        self._refresh_live()

    @override
    def _use_room(self) -> None:
        """Put the pen in space between the others, or below them on a narrow page."""
        self._content.set_squeezed(not self._room.is_low)
        if self._room.is_narrow:
            self._rows.addWidget(self._space)
        else:
            self._panels.insertWidget(1, self._space)
        self._share_room()

    def _share_room(self) -> None:
        """Divide the width; on a vast page the table has all it needs by less."""
        shares = VAST_SHARES if self._room.is_vast else SHARES
        panels = self._table, self._space, self._match
        for panel, share in zip(panels, shares, strict=True):
            self._panels.setStretchFactor(panel, share)

    @property
    def _is_edited(self) -> bool:
        return self._draft != self._opened

    @property
    def _is_pending(self) -> bool:
        """Whether the table shows something else than the file in use."""
        return self._is_edited or self._is_foreign

    @property
    def _changes(self) -> Changes:
        if self._is_edited:
            return Changes.EDITED
        return Changes.FOREIGN if self._is_foreign else Changes.NONE

    def _why_not(self) -> str:
        if self._is_pending:
            if self._check.usable is None:
                return self.tr("Mend the LED table first: what is wrong is told above.")
            return self.tr("Save the LED table first: the record needs its file.")
        for lack in self._workbench.preparation.leds_lacks():
            return lack_text(lack)
        return ""

    def _on_workbench_changed(self) -> None:
        preparation = self._workbench.preparation
        file = preparation.pen_file
        if file is not self._in_use:
            self._in_use = file
            changed = self._draft if self._is_edited else None
            self._open_in_use()
            if changed is not None:
                self._edit(changed)
        self._file.set_has_samples(preparation.source.kind == SourceKind.SIMULATED)
        self._refresh()
        self._aim()

    def _open_in_use(self) -> None:
        file = self._in_use
        self._file.set_value("" if file is None else str(file.path))
        draft = PenDraft() if file is None else PenDraft.of(file.pen)
        self._open_draft(draft, foreign=False)

    def _open_draft(self, draft: PenDraft, *, foreign: bool) -> None:
        """Show a draft as it was opened, with nothing to complain about yet."""
        self._opened, self._is_foreign = draft, foreign
        self._file.ask_units("")
        if draft != self._draft:  # else it is what was saved now
            self._edits.clear()
        self._set_draft(draft)

    def _edit(self, draft: PenDraft) -> None:
        """Show another draft, from which the way back is open."""
        self._edits.push(DraftEdit(self._set_draft, self._draft, draft))

    def _set_draft(self, draft: PenDraft) -> None:
        if draft != self._draft:
            self._file.withdraw()
        self._draft = draft
        self._table.set_value(draft, self._changes)
        in_use = None if self._is_pending else self._in_use
        self._check = check_draft(draft, None if in_use is None else in_use.pen)
        frame = self._check.frame
        self._table.set_flaw(worded(self._check.flaw))
        self._tell(self._frame_error)
        self._file.set_exchange(leds_to_exchange(frame))
        self._match.set_has_frame(frame is None or not frame.error)
        is_as_typed = self._check.sought is self._check.pen
        self._match.set_can_mend(is_as_typed)
        preparation = self._workbench.preparation
        if preparation.has_unsaved_leds is not self._is_pending:
            self._workbench.set_preparation(
                replace(preparation, has_unsaved_leds=self._is_pending)
            )
        self._refresh()
        self._aim()
        self.changed.emit()

    def _tell(self, problem: Callable[[], str]) -> None:
        """Say what is wrong with the file, in each language anew."""
        self._problem = problem
        self._file.set_problem(problem())

    def _frame_error(self) -> str:
        frame = self._check.frame
        return "" if frame is None else worded(frame.error)

    def _refresh(self) -> None:
        """Show what follows from the draft."""
        pen = self._check.pen
        tip = self._workbench.preparation.nominal_tip
        if tip is None and pen is not None:
            tip = pen.nominal_tip
        marked = frozenset(self._match.reasons())
        self._space.set_value(self._check.frame)
        self._space.set_picture(PenPicture(pen, tip, marked))
        self._table.set_overriding_tip(self._overriding_tip())
        why_not = ""
        if not self._draft.rows:
            why_not = self.tr("There are no LEDs yet.")
        elif self._check.usable is None:
            why_not = self.tr("Mend the LEDs first: a file of these cannot be used.")
        with_more = bool(self._draft.name or any(self._draft.tip))
        self._file.set_savable(why_not, "json" if with_more else "csv")

    def _overriding_tip(self) -> str:
        """Return the nominal tip in force where it is not that of the table."""
        tip = self._workbench.preparation.nominal_tip
        if tip is None or self._check.pen is None:
            return ""
        return "  ".join(f"{each:g}" for each in tip.tolist())

    # Files

    def _on_path_chosen(self, path: str) -> None:
        self._unless_lost(partial(self._open, Path(path)))

    def _on_units_chosen(self, path: str, units: str) -> None:
        self._unless_lost(partial(self._open, Path(path), units))

    def _on_samples_requested(self) -> None:
        self._unless_lost(self._use_samples)

    def _on_discard_requested(self) -> None:
        self._unless_lost(self._discard)

    def _discard(self) -> None:
        """Go back to what was opened; from what cannot be used, to the file in use."""
        if self._is_edited:
            self._edit(self._opened)
        else:
            self._open_in_use()

    def _unless_lost(self, act: Callable[[], None]) -> None:
        """Do what gives up the changes of the table, but ask before."""
        if not self._is_edited:
            act()
            return
        self._file.ask(self._discarding, act)

    def _discarding(self) -> tuple[str, str]:
        text = self.tr("The LED table has changes that are not saved.")
        return text, self.tr("Discard them")

    def _unless_changed(self, before: PenDraft, act: Callable[[], None]) -> None:
        """Do what gives up the table, but ask if it was changed since a draft."""
        if self._draft == before:
            act()
        else:
            self._unless_lost(act)

    def _open(self, path: Path, units: str | None = None) -> None:
        self.status_changed.emit("")
        self._file.ask_units("")
        before = self._draft

        def take(opened: OpenedPen) -> None:
            self._unless_changed(before, partial(self._on_opened, opened))

        self._start(lambda _: open_pen(path, units), take)

    def _on_opened(self, opened: OpenedPen) -> None:
        if opened.file is not None:
            self._use(opened.file)
        elif opened.draft is not None:  # those in use stay in use
            self._open_draft(opened.draft, foreign=True)
            self._file.set_value(str(opened.path))
            self._tell(partial(worded, opened.problem))
        elif opened.needs_units:
            self._tell(str)
            self._file.ask_units(opened.path.name)
        else:
            self._tell(partial(self._refusal, opened.problem, self._file.value()))

    def _refusal(self, why: Sentence | None, still_open: str) -> str:
        """Return why a file cannot be opened, and which one is open."""
        if not still_open:
            return worded(why)
        kept = self.tr("{0} stays open.").format(Path(still_open).name)
        return f"{worded(why)} {kept}"

    def _use(self, file: PenFile) -> None:
        """Put a file in use, and show it without changes."""
        self._put_in_use(file)
        self._open_in_use()
        self._tell(str)
        self.changed.emit()

    def _put_in_use(self, file: PenFile) -> None:
        preparation = self._workbench.preparation
        self._workbench.set_preparation(replace(preparation, pen_file=file))

    def _use_samples(self) -> None:
        if self._is_edited:
            self._set_draft(self._opened)
        self._workbench.use_sample_files()

    def _on_save_chosen(self, path: Path) -> None:
        pen = self._check.usable
        if pen is not None:
            on_saved = partial(self._on_saved, self._draft)
            self._start(lambda _: save_pen(pen, path), on_saved)

    def _on_saved(self, saved: PenDraft, file: PenFile) -> None:
        if self._draft == saved:
            self._use(file)
        else:  # what was typed since stays
            self._put_in_use(file)
        words = self.tr("The LEDs are saved as {0} and in use.")
        self.status_changed.emit(words.format(file.path.name))

    def _start(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], None]
    ) -> None:
        """Read or write a file; an earlier one that is under way is not waited for."""
        self._drop_job()
        self._job = job = Job(function, self)

        # Connections
        job.succeeded.connect(on_succeeded)
        job.failed.connect(self._on_failed)
        job.start()

    def _on_failed(self, sentence: str) -> None:
        self._tell(lambda: sentence)

    def _drop_job(self) -> None:
        if self._job is not None:
            self._job.cancel()

    # The table

    def _on_move_requested(self) -> None:
        if self._check.sought is not None:
            self._edit(PenDraft.of(self._check.sought))

    def _on_exchange_requested(self, pair: tuple[int, int]) -> None:
        self._table.focus_cells()
        self._edit(exchanged(self._draft, pair))

    def _on_mend_requested(self, finding: Finding) -> None:
        self._table.focus_cells()
        self._edit(mended(self._draft, finding))

    # Live images

    def _aim(self) -> None:
        """Look for the pen of the table, also before it is saved."""
        if not self._is_shown:
            return
        pen = self._check.sought
        preparation = self._workbench.preparation
        self._watch.set_pen(preparation.camera, pen)
        status = self._workbench.run.status
        swung = status.setup if status.is_capturing else None
        self._match.set_aside(swung is not None and _differ(swung.pen, pen))
        if not status.is_capturing:
            aimed = replace(preparation.aim, pen=pen)
            self._workbench.live.set_aim(aimed if self._is_pending else preparation.aim)
        self._refresh_live()

    def _refresh_live(self) -> None:
        """Say what is missing to find the pen in the images."""
        preparation = self._workbench.preparation
        if not self._workbench.live.is_open:
            why = self.tr("The camera is not open. See the step Camera.")
        elif self._workbench.live.worst_connection is Connection.LOST:
            why = self.tr("The camera is lost. It is looked for until it is back.")
        elif preparation.camera is None:
            why = self.tr("The intrinsics are missing. See the step Camera.")
        elif self._check.sought is None:
            why = self.tr("Enter or mend the LEDs, so that they can be looked for.")
        else:
            why = ""
        self._match.set_why_unknown(why)

    def _on_image_shown(self, shown: Shown) -> None:
        is_live = self._workbench.live.worst_connection is Connection.STREAMING
        if not (self._is_shown and is_live):  # the last image comes after the loss
            return
        self._match.set_image(shown)
        self._watch.add(shown.seen.spots)

    def _on_connection_changed(self) -> None:
        if self._is_shown:
            self._workbench.live.show_pen()
            if self._workbench.live.worst_connection is not Connection.STREAMING:
                self._match.clear()
            self._refresh_live()

    def _on_match_changed(self, match: PenMatch | None) -> None:
        self._match.set_value(match)
        misfits = {} if match is None else _misfits(match)
        self._table.set_misfits(misfits)
        self._table.set_marked(self._match.reasons())
        self._refresh()


def _differ(swung: Pen, pen: Pen | None) -> bool:
    """Return whether the LEDs of a table are not those that a swing began with."""
    return pen is None or not np.array_equal(swung.leds, pen.leds)


def _misfits(match: PenMatch) -> dict[int, float]:
    """Return the misfit of each LED that is seen, px, by its number."""
    numbered = enumerate(match.rms.tolist(), 1)
    return {led: rms for led, rms in numbered if rms == rms}
