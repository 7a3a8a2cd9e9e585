"""The step Verify: from the tip in force to its verdict, without a key."""

from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import (
    QHBoxLayout,
    QProgressBar,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.estimation.verdict import Grade
from lightpen.model.origin import Origin
from lightpen.record.standing import TipStanding
from lightpen.verification.choices import TaskKind
from lightpen.verification.status import Reading, SessionHappening
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.phrases import grade_text, lack_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.look.theme import GRID, TextSize, Tone
from lightpen_app.look.words import PARTED, moment_text, shortened
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.steps.verify.findings import (
    ArticulationFinding,
    DriftFinding,
    FixedPointFinding,
    LengthFinding,
    RingFinding,
)
from lightpen_app.steps.verify.strips import (
    ArticulationStrip,
    DriftStrip,
    FixedPointStrip,
    LengthStrip,
    RingStrip,
)
from lightpen_app.steps.verify.task_panel import TaskPanel
from lightpen_app.steps.verify.touch_hand import TouchHand
from lightpen_app.steps.verify.words import VerifyMoment, VerifyWords
from lightpen_app.widgets.fitted_text import FittedText
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.late import Late
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.page_scroll import PageScroll, Squeezed
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.question_bar import Question, QuestionBar
from lightpen_app.widgets.rearranged import NO_ROOM, Rearranged
from lightpen_app.widgets.reason_bar import ReasonBar
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.standing_mark import standing_text
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_app.work.live_view import Shown
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen_app.steps.verify.pen_panel import PenPanel

SHOWING_MS = 50  # from a new state to what is shown; the states between make one
PROGRESS_STEPS = 1000
IMAGE_WIDTH = 56 * GRID  # px, at least
STATE_HEIGHT, VERDICT_HEIGHT = 9 * GRID, 13 * GRID  # px; a verdict has its reason

SOUNDS: dict[SessionHappening, Sound] = {
    SessionHappening.TAKEN: Sound.KEPT,
    SessionHappening.BROKEN_OFF: Sound.LOST,
    SessionHappening.KNOWN: Sound.LOST,
    SessionHappening.FINISHED: Sound.FIELD_FULL,
    SessionHappening.DONE: Sound.DONE,
    SessionHappening.FAILED: Sound.FAILED,
}


class VerifyPage(Rearranged, Page):
    """Shows a verification and leads it; nothing on it must be pressed meanwhile."""

    key = "verify"
    shows_images = True
    narrow_below = 150 * GRID  # px; then the live image is in a tab

    def __init__(
        self, workbench: Workbench, sounds: Sounds, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._workbench, self._sounds = workbench, sounds
        self._run, self._live = workbench.verification, workbench.live
        self._runner = self._run.runner
        self._words = VerifyWords(self)
        self._room = NO_ROOM
        self._reading = 0.0
        self._task: TaskKind | None = None
        self._said: tuple[MainAction, bool, str] | None = None
        self._is_entered = False

        # Widgets
        self._instruction = FittedText(TextSize.HUGE)
        self._instruction.setMinimumHeight(6 * GRID)
        self._act = PushButton()
        self._start_over = PushButton()
        self._accept = PushButton()
        self._question = QuestionBar()
        self._question.set_words(self._starting_over)
        self._reason = ReasonBar()
        self._hint = FittedText(TextSize.LEAD, least=TextSize.BODY)
        self._banner = StateBanner(TextSize.TITLE)
        self._witness = SignLabel()
        self._numbers = QWidget()
        self._count = FittedText(TextSize.DISPLAY)
        self._progress = QProgressBar()
        self._progress.setRange(0, PROGRESS_STEPS)
        self._progress.setTextVisible(False)
        self._panels = (
            TaskPanel(FixedPointStrip(), FixedPointFinding()),
            TaskPanel(RingStrip(), RingFinding()),
            TaskPanel(LengthStrip(), LengthFinding()),
            TaskPanel(ArticulationStrip(), ArticulationFinding()),
            TaskPanel(DriftStrip(), DriftFinding()),
        )
        self._pen: Late[PenPanel] = Late(self._make_pen_panel)
        self._pen_tab = PageScroll()
        self._pen_tab.setWidget(Squeezed(self._pen))
        self._tabs = QTabWidget()
        for tab in (*self._panels, self._pen_tab):
            self._tabs.addTab(tab, "")
        self._image = ImageView()
        self._hand = TouchHand(self._live)
        self._showing = QTimer(self)
        self._showing.setSingleShot(True)
        self._showing.setInterval(SHOWING_MS)

        # Layout
        self._arrange()

        # Connections
        self._run.changed.connect(self._show_soon)
        self._run.happened.connect(self._on_happened)
        self._run.progressed.connect(self._on_progressed)
        self._run.troubled.connect(self._on_troubled)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._show_soon)
        workbench.changed.connect(self._on_workbench_changed)
        workbench.library.changed.connect(self.changed)
        self._act.clicked.connect(self.toggle_pause)
        self._start_over.clicked.connect(self._on_start_over_clicked)
        self._question.agreed.connect(self._runner.start_over)
        self._accept.clicked.connect(self._ask_reason)
        self._reason.given.connect(self._runner.accept)
        self._reason.declined.connect(self._tabs.setFocus)
        self._showing.timeout.connect(self._show)
        for panel in self._panels:
            panel.value_changed.connect(workbench.set_choices)
            panel.anew_requested.connect(self._runner.touch_anew)
            panel.read_requested.connect(self._on_read_requested)
            panel.cancel_requested.connect(self._runner.cancel)

        self._on_workbench_changed()
        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("Verify")

    @override
    def lead(self) -> str:
        tip = self._run.status.tip
        if tip is None:
            return self.tr("Prove the tip in force by touching what is known.")
        when = moment_text(tip.calibration.when, self.tr("d MMMM yyyy, hh:mm"))
        words = self.tr("Tip {0} of pen {1}, in force since {2}").format(
            shortened(tip.names.tip), shortened(tip.names.pen), when
        )
        files = ", ".join(file.name for file in self._run.status.files)
        by = self._run.status.accepted_by
        accepted = self.tr("accepted by {0}").format(shortened(by)) if by else ""
        kept = self.tr("kept as {0}").format(files) if files else ""
        return PARTED.join(
            filter(None, (words, self._doubt(), self._standing(), kept, accepted))
        )

    @override
    def lead_tone(self) -> Tone:
        return Tone.WARN if self._doubt() else Tone.QUIET

    def _doubt(self) -> str:
        """Return the grade of the tip, a word, where it was accepted with doubts."""
        tip = self._run.status.tip
        is_doubted = tip is not None and tip.calibration.grade == Grade.CHECK
        return grade_text(Grade.CHECK) if is_doubted else ""

    def _standing(self) -> str:
        """Return what is the matter with the tip, a word; nothing of a valid one."""
        tip, standings = self._run.status.tip, self._workbench.library.standings
        if tip is None or self._workbench.preparation.origin is Origin.SIMULATED:
            return ""
        standing = standings.of_tip(tip.names.pen, tip.names.tip)
        return "" if standing in (None, TipStanding.VALID) else standing_text(standing)

    @override
    def is_complete(self) -> bool:
        return self._run.status.is_done

    @override
    def is_doubtful(self) -> bool:
        found = self._run.status.assessment
        return found is not None and found.grade is not Grade.PASS

    @override
    def why_closed(self) -> str:
        lacks = self._workbench.preparation.lacks()
        return lack_text(lacks[0]) if lacks else ""

    @override
    def main_action(self) -> MainAction:
        status = self._run.status
        if status.is_done:
            return MainAction(self.tr("Back to Start"))
        why_not = ""
        if status.state is None or not status.state.touches:
            why_not = self.tr("Nothing is touched yet.")
        return MainAction(self.tr("Finish early"), why_not)

    @override
    def run_main_action(self) -> None:
        if self._run.status.is_done:
            self.step_requested.emit("start")
        else:
            self._runner.end_task()

    @override
    def is_hands_free(self) -> bool:
        return True

    @override
    def toggle_pause(self) -> None:
        if self._run.status.is_paused:
            self._runner.resume()
        else:
            self._runner.pause()

    @override
    def first_control(self) -> QWidget:
        return self._tabs

    @override
    def entered(self) -> None:
        self._is_entered = True
        if not self._live.is_open:
            self._workbench.open_camera()
        self._runner.come()
        self._show()

    @override
    def left(self) -> None:
        self._is_entered = False
        self._question.hide()
        self._hand.stop()
        self._runner.leave()

    @override
    def unsaved(self) -> str:
        state = self._runner.status.state
        if state is None or not (state.touches or state.runs or state.visits):
            return ""
        return self.tr(
            "The verification is not finished. The touches of the task at hand are "
            "lost; what is found is kept."
        )

    @override
    def shut_down(self) -> None:
        self._showing.stop()
        pen = self._pen.content_so_far()
        if pen is not None:
            pen.shut_down()

    @override
    def _retranslate(self) -> None:
        self._reason.set_words(
            self.tr(
                "Something was found against the tip. Why is it used nevertheless? The "
                "reason is kept with the verification."
            ),
            self.tr("Reason"),
            self.tr("Accept with this reason"),
            self.tr("Do not accept"),
        )
        self._accept.setText(self.tr("Accept..."))
        self._accept.setToolTip(self.tr("Use the tip with a reason"))
        self._start_over.setText(self.tr("Start over"))
        self._start_over.setToolTip(
            self.tr("Forget all touches, and verify the tip in force from the first.")
        )
        self._image.set_message(self.tr("No image yet."))
        self._progress.setAccessibleName(self.tr("Progress"))
        self._tabs.setAccessibleName(self.tr("Tasks"))
        self._tabs.setTabText(self._tabs.indexOf(self._pen_tab), self.tr("Pen"))
        if self._room.is_narrow:
            index = self._tabs.indexOf(self._image)
            self._tabs.setTabText(index, self.tr("Live image"))
        self._show()

    def _starting_over(self) -> Question:
        return Question(
            self.tr("Begin the verification anew? What was found is kept."),
            self.tr("Begin anew"),
            self.tr("Go on"),
        )

    def _arrange(self) -> None:
        head = QHBoxLayout()
        head.setSpacing(GRID)
        head.addWidget(self._instruction, 1)
        head.addWidget(self._accept)
        head.addWidget(self._act)
        head.addWidget(self._start_over)
        numbers = QVBoxLayout(self._numbers)
        numbers.setContentsMargins(0, 0, 0, 0)
        numbers.setSpacing(GRID // 2)
        numbers.addWidget(self._count)
        numbers.addWidget(self._progress)
        state = QHBoxLayout()
        state.setSpacing(2 * GRID)
        state.addWidget(self._banner, 3)
        state.addWidget(self._numbers, 2)
        self._body = body = QHBoxLayout()
        body.setSpacing(2 * GRID)
        scroll = PageScroll()
        scroll.setWidget(Squeezed(self._tabs))
        body.addWidget(scroll, 3)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._question)
        layout.addWidget(self._reason)
        layout.addLayout(head)
        layout.addWidget(self._hint)
        layout.addLayout(state)
        layout.addWidget(self._witness)
        layout.addLayout(body, 1)
        layout.addWidget(self._hand)
        self._use_room()

    @override
    def _use_room(self) -> None:
        """Put the live image beside the tasks, or in a tab of its own."""
        if self._room.is_narrow:
            self._image.setMinimumWidth(0)
            self._tabs.addTab(self._image, self.tr("Live image"))
        else:
            self._image.setMinimumWidth(IMAGE_WIDTH)
            self._body.addWidget(self._image, 2)
            self._image.show()  # a tab that is not the current one is hidden

    def _make_pen_panel(self) -> "PenPanel":
        # What draws its plot takes long to be imported.
        from lightpen_app.steps.verify.pen_panel import PenPanel

        return PenPanel(self._workbench)

    def _moment(self) -> VerifyMoment:
        return VerifyMoment(self._run.status, self._live.connection, self._reading)

    def _show_soon(self) -> None:
        if not self._showing.isActive():
            self._showing.start()

    def _show(self) -> None:
        """Show what is the case now, here and in the operator view."""
        status = self._run.status
        value = self._words.operator_value(self._moment())
        self._instruction.set_text(value.instruction)
        self._hint.set_text(value.hint, bold=False)
        self._banner.set_value(value.state)
        self._banner.setFixedHeight(VERDICT_HEIGHT if status.is_done else STATE_HEIGHT)
        self._count.set_text(value.count)
        self._witness.set_value(self._witness_remark())
        self._numbers.setVisible(value.fraction is not None)
        self._progress.setValue(round(PROGRESS_STEPS * (value.fraction or 0.0)))
        reading = self._reading if status.reading is Reading.IMAGES else None
        for index, panel in enumerate(self._panels):
            panel.set_status(status, reading)
            self._tabs.setTabText(index, self._words.tab(panel.kind, status))
        self._follow_task()
        self._act.setText(
            self.tr("Go on (Space)") if status.is_paused else self.tr("Pause (Space)")
        )
        self._act.setEnabled(status.task is not None)
        self._accept.setVisible(self._can_be_accepted())
        if not self._can_be_accepted():
            self._reason.hide()
        if self._is_entered:
            self.operator_value_changed.emit(value)
        said = self.main_action(), self.is_complete(), self.lead()
        if said != self._said:
            self._said = said
            self.changed.emit()

    def _witness_remark(self) -> Remark:
        """Return what fixed lamps tell of the camera, unless it stands above."""
        status = self._run.status
        told = None if status.witness is None else status.witness.assessment
        if told is None or (status.is_done and told is status.assessment):
            return Remark()
        return Remark(worded(told.reason), *GRADE_MARKS[told.grade])

    def _can_be_accepted(self) -> bool:
        """Return whether the tip is no pass, and nobody has accepted it yet."""
        return (
            self.is_complete()
            and self.is_doubtful()
            and not self._run.status.accepted_by
        )

    def _ask_reason(self) -> None:
        found = self._run.status.assessment
        is_beyond = found is not None and found.grade is Grade.REPEAT
        is_guarded = self._workbench.supervision.is_guarded
        self._reason.ask(of_supervisor=is_guarded or is_beyond)

    def _follow_task(self) -> None:
        """Show the task at hand when it has become another one."""
        task = self._run.status.task
        if task is not None and task is not self._task:
            kinds = [panel.kind for panel in self._panels]
            self._tabs.setCurrentIndex(kinds.index(task))
        self._task = task

    def _on_workbench_changed(self) -> None:
        for panel in self._panels:
            panel.set_choices(self._workbench.choices)
        self._show_soon()
        self.changed.emit()

    def _on_read_requested(self, kind: TaskKind, place: str, is_still: bool) -> None:
        self._reading = 0.0
        self._runner.read(kind, place, is_still=is_still)

    def _on_happened(self, what: SessionHappening) -> None:
        value = self._words.operator_value(self._moment())
        self._sounds.play(SOUNDS[what], value.fraction or 0.0)

    def _on_troubled(self) -> None:
        if self._can_be_accepted():
            self._reason.refuse()

    def _on_progressed(self, fraction: float) -> None:
        self._reading = fraction
        self._show_soon()

    def _on_image_shown(self, shown: Shown) -> None:
        if self._image.isVisible():
            self._image.set_half(shown.half, shown.size, live_markers(shown.seen))

    def _on_start_over_clicked(self) -> None:
        state = self._run.status.state
        if state is not None and state.is_begun and not self._run.status.is_done:
            self._question.ask()
        else:
            self._runner.start_over()
