"""Files of the step LEDs: opening, and saving the table."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QObject, Signal

from lightpen.formats.opened_files import PenFile
from lightpen.messages import Message
from lightpen.pen_check.draft import (
    OpenedPen,
    PenDraft,
    leds_to_exchange,
    open_pen,
    save_pen,
)
from lightpen_app.look.sentences import worded
from lightpen_app.steps.leds.draft import (
    LedDraft,
    LedState,
    unsaved_leds_text,
    why_not_savable,
)
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.work.chosen_files import ChosenFiles
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.pen_files import PenFiles

T = TypeVar("T")


class LedFileControl(QObject):
    """Carries out requests of the file panel; asks before edits are lost."""

    status_changed = Signal(str)  # text of the status line

    def __init__(
        self,
        leds: LedDraft,
        chosen_files: ChosenFiles,
        pens: PenFiles,
        panel: LedFilePanel,
    ) -> None:
        super().__init__(panel)
        self._leds, self._chosen_files, self._panel = leds, chosen_files, panel
        self._pens = pens
        self._shown = LedState()
        self._problem: Callable[[], str] = self._frame_error
        self._job = LatestJob(self)

        # Connections
        panel.path_chosen.connect(self._on_path_chosen)
        panel.units_chosen.connect(self._on_units_chosen)
        panel.save_chosen.connect(self._on_save_chosen)
        panel.samples_requested.connect(self._on_samples_requested)
        leds.changed.connect(self._on_draft_changed)

    def retranslate(self) -> None:
        """Update the messages on the file."""
        self._panel.set_problem(self._problem())
        draft = self._leds.state.draft
        with_more = bool(draft.name or any(draft.tip))
        why_not = why_not_savable(self._leds.state)
        self._panel.set_savable(why_not, "json" if with_more else "csv")

    def discard(self) -> None:
        """Discard the changes of the table, or a file that cannot be used."""
        self._unless_lost(self._discard)

    def drop_job(self) -> None:
        """Ignore the outcome of a file being read or written."""
        self._job.cancel()

    def _on_draft_changed(self) -> None:
        before, self._shown = self._shown, self._leds.state
        now = self._shown
        if now.draft != before.draft:
            self._panel.withdraw()
        if now.opened is not before.opened or now.path != before.path:
            self._panel.ask_units("")
            self._panel.set_value(now.path)
        self._panel.set_exchange(leds_to_exchange(now.check.frame))
        self._set_problem(self._frame_error)

    def _set_problem(self, problem: Callable[[], str]) -> None:
        """Show a message on the file in the selected language."""
        self._problem = problem
        self.retranslate()

    def _frame_error(self) -> str:
        frame = self._leds.state.check.frame
        return "" if frame is None else worded(frame.error)

    def _on_path_chosen(self, path: str) -> None:
        self._unless_lost(partial(self._open, Path(path)))

    def _on_units_chosen(self, path: str, units: str) -> None:
        self._unless_lost(partial(self._open, Path(path), units))

    def _on_samples_requested(self) -> None:
        self._unless_lost(self._use_samples)

    def _discard(self) -> None:
        """Return to the opened file, or to the file in use if that is invalid."""
        if self._leds.state.is_edited:
            self._leds.edit(self._leds.state.opened)
        else:
            self._leds.open_in_use()

    def _unless_lost(self, act: Callable[[], None]) -> None:
        """Run a function that discards the changes of the table, once confirmed."""
        if self._leds.state.is_edited:
            self._panel.ask(self._discarding, act)
        else:
            act()

    def _discarding(self) -> tuple[str, str]:
        return unsaved_leds_text(self._leds.state), self.tr("Discard changes")

    def _open(self, path: Path, units: str | None = None) -> None:
        self.status_changed.emit("")
        self._panel.ask_units("")
        before = self._leds.state.draft

        def take(opened: OpenedPen) -> None:
            """Show the file; ask first if the table has unsaved changes."""
            act = partial(self._on_opened, opened)
            if self._leds.state.draft == before:
                act()
            else:
                self._unless_lost(act)

        self._start(lambda _: open_pen(path, units), take)

    def _on_opened(self, opened: OpenedPen) -> None:
        if opened.file is not None and self._pens.doubt_about(opened.file):
            use = partial(self._use, opened.file)
            self._panel.ask(partial(self._doubt_question, opened.file), use)
        elif opened.file is not None:
            self._use(opened.file)
        elif opened.draft is not None:  # those in use stay in use
            self._leds.open(opened.draft, opened.path)
            self._set_problem(partial(worded, opened.problem))
        elif opened.needs_units:
            self._set_problem(str)
            self._panel.ask_units(opened.path.name)
        else:
            self._set_problem(
                partial(self._refusal, opened.problem, self._panel.value())
            )

    def _use(self, file: PenFile) -> None:
        self._leds.use(file)
        self._pens.keep(file)
        self._set_problem(str)

    def _doubt_question(self, file: PenFile) -> tuple[str, str]:
        words = self.tr("{0} Use it for this pen from now on?")
        text = words.format(self._pens.doubt_about(file))
        return text, self.tr("Use this file")

    def _refusal(self, why: Message | None, still_open: str) -> str:
        """Return why a file cannot be opened, and which one is open."""
        if not still_open:
            return worded(why)
        kept = self.tr("{0} remains open.").format(Path(still_open).name)
        return f"{worded(why)} {kept}"

    def _use_samples(self) -> None:
        if self._leds.state.is_edited:
            self._leds.show(self._leds.state.opened)
        self._chosen_files.use_samples()

    def _on_save_chosen(self, path: Path) -> None:
        state = self._leds.state
        pen = state.check.usable
        if pen is not None:
            on_saved = partial(self._on_saved, state.draft)
            self._start(lambda _: save_pen(pen, path), on_saved)

    def _on_saved(self, saved: PenDraft, file: PenFile) -> None:
        is_same = self._leds.state.draft == saved
        self._leds.use(file, keeps_changes=not is_same)
        self._pens.keep(file)
        if is_same:
            self._set_problem(str)
        words = self.tr("LEDs saved as {0} and in use.")
        self.status_changed.emit(words.format(file.path.name))

    def _start(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], None]
    ) -> None:
        """Read or write a file, and ignore the outcome of an earlier one."""
        self._job.start(
            function, on_succeeded, lambda sentence: self._set_problem(lambda: sentence)
        )
