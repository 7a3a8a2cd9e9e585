"""Dialog for the limits of a station, set by a supervisor."""

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QLabel, QLineEdit, QWidget
from typing_extensions import override

from lightpen.model.limits import LIMITS, Limit, StationLimits
from lightpen.record.library.supervision import Signature, Supervision, read_supervision
from lightpen.record.library.supervision_changes import save_limits
from lightpen_app.look.layouts import fill, grid_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import phrases_whole
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.page_scroll import DialogScroll
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.supervisor_fields import SupervisorFields
from lightpen_app.widgets.translated import Translated, core_text
from lightpen_app.work.job import Job
from lightpen_app.work.workbench import Workbench


class LimitsDialog(FittedWindow, Translated, QDialog):
    """Shows limits; a supervisor may change them."""

    # StationLimits, Signature, str: limits, who signs, and a new password or none.
    signed = Signal(object, object, str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.say(self, self.tr("Acceptance limits of the station"))
        self._value = StationLimits()
        self._is_guarded = False
        self._is_signed = False  # and waits for the outcome

        # Widgets
        self._lead = self.say(
            text_label(TextSize.BODY),
            self.tr(
                "Results outside these limits need a supervisor's approval and a "
                "reason. Each change is recorded with name and time."
            ),
        )
        self._fields = {
            limit.key: _RuleField() if limit.choices else _number_field(limit)
            for limit in LIMITS
        }
        self._signing = text_label(TextSize.SMALL, Tone.QUIET)
        self._supervisor = SupervisorFields()
        new = self.tr("New password; empty to keep the current one")
        self._new_password = self.say(QLineEdit(), hint=new)
        self._new_password.setEchoMode(QLineEdit.EchoMode.Password)
        self._fault = SignLabel()
        standard = QDialogButtonBox.StandardButton
        self._buttons = QDialogButtonBox(standard.Save | standard.Close)
        self.say(self._buttons.button(standard.Close), self.tr("Close"))
        self._save = self.say(
            self._buttons.button(standard.Save), self.tr("Save limits")
        )

        # Layout
        layout = vertical_layout(self, self._lead, margins=3 * GRID)
        fields, scroll = QWidget(), DialogScroll()
        grid = grid_layout(fields, spacing=(2 * GRID, GRID // 2))
        for column in (0, 2):
            grid.setColumnStretch(column, 1)
        n_rows = (len(self._fields) + 1) // 2
        for index, field in enumerate(self._fields.values()):
            column, row = divmod(index, n_rows)
            grid.addWidget(self._label(LIMITS[index], field), row, 2 * column)
            grid.addWidget(field, row, 2 * column + 1)
        scroll.setWidget(fields)
        fill(layout, (scroll, 1))
        fill(layout, self._signing, self._supervisor, self._new_password)
        fill(layout, self._fault, self._buttons)
        self.setMinimumWidth(98 * GRID)

        # Connections
        self._supervisor.value_edited.connect(self._refresh)
        self._supervisor.entered.connect(self._on_entered)
        self._new_password.returnPressed.connect(self._on_entered)
        self._save.clicked.connect(self._on_save_clicked)
        self._buttons.rejected.connect(self.reject)

        self.set_value(self._value, is_guarded=False)
        self._retranslate()

    def value(self) -> StationLimits:
        """Return the limits as they are typed."""
        typed = {key: field.value() for key, field in self._fields.items()}
        return self._value.with_values(typed)

    def set_value(self, limits: StationLimits, *, is_guarded: bool) -> None:
        """Show limits, and whether there is a password already."""
        self._value, self._is_guarded = limits, is_guarded
        for limit in LIMITS:
            self._fields[limit.key].set_value(limits.value(limit))
        self._supervisor.clear()
        self._new_password.clear()
        self._new_password.setVisible(is_guarded)
        self._is_signed = False
        self._fault.set_value(StatusMessage())
        self._retranslate()
        self._refresh()

    def show_fault(self, fault: str) -> None:
        """Show why nothing was saved."""
        self._is_signed = False
        self._fault.set_value(StatusMessage.fault(fault))
        self._supervisor.clear_password()

    def _refresh(self) -> None:
        self._save.setEnabled(self._supervisor.is_filled() and not self._is_signed)

    def _on_entered(self) -> None:
        if self._save.isEnabled():
            self._on_save_clicked()

    def _on_save_clicked(self) -> None:
        if is_refusing(self):
            return
        limits = self.value()
        if limits.swing.min_images > limits.swing.max_images:
            self.show_fault(
                self.tr("The minimum number of images exceeds the maximum number.")
            )
            return
        self._is_signed = True
        self._refresh()
        new = self._new_password.text()
        self.signed.emit(limits, self._supervisor.value(), new)

    @override
    def _retranslate(self) -> None:
        self._signing.setText(
            self.tr("Sign with the supervisor password.")
            if self._is_guarded
            else self.tr(
                "No password is set. The one you enter becomes the supervisor password."
            )
        )

    def _label(self, limit: Limit, field: QWidget) -> QLabel:
        """Return the label of a field, which tells the default."""
        is_absent = not limit.range[0] and not limit.unit
        no_limit = self.tr("No limit") if is_absent else ""
        usual = no_limit or f"{limit.default:g}"
        if isinstance(field, _RuleField):
            choices = [core_text(each) for each in limit.choices]
            self.say_items(field, choices)
            usual = choices[round(limit.default)]
        tip = self.tr("Default: {0}.").format(usual)
        label = self.make_label(field, core_text(limit.label), tip=tip, hint=no_limit)
        label.setWordWrap(True)
        return self.say(label, core_text(limit.label, phrases_whole))


class _RuleField(ChoiceField):
    """A choice of a limit by its index, as `Limit` has it."""

    def value(self) -> float:
        """Return the index of the choice."""
        return float(self.currentIndex())

    def set_value(self, value: float) -> None:
        """Show the choice of an index."""
        self.setCurrentIndex(round(value))


def _number_field(limit: Limit) -> NumberField:
    n_decimals = {"": 0, "%": 1}.get(limit.unit, 4)
    return NumberField(limit.unit, limit.range, n_decimals)


class LimitsControl(QObject):
    """Shows the limits of the station and saves signed changes."""

    def __init__(self, workbench: Workbench, page: QWidget) -> None:
        super().__init__(page)
        self._selection = workbench.selection
        self._archive_writer = workbench.archive_writer
        self._folder, self._clock = workbench.folder, workbench.around.now
        self._dialog = LimitsDialog(page)
        self._saving: Job | None = None
        self._shown = StationLimits()

        # Connections
        self._dialog.signed.connect(self._on_signed)

    def open(self) -> None:
        """Show the dialog."""
        limits = self._selection.limits
        is_guarded = self._selection.supervision.is_guarded
        self._shown = limits
        self._dialog.set_value(limits, is_guarded=is_guarded)
        self._dialog.open()

    def shut_down(self) -> None:
        """Cancel saving."""
        if self._saving is not None:
            self._saving.cancel()

    def _on_signed(
        self, limits: StationLimits, signature: Signature, new_password: str
    ) -> None:
        folder, now, before = self._folder, self._clock, self._shown
        station = self._selection.preparation.names.station
        self._saving = job = Job(
            lambda _: save_limits(
                folder, station, limits, signature, new_password, now(), before
            ),
            self,
        )
        job.start(self._on_saved, self._on_failed)

    def _on_failed(self, why: str) -> None:
        """Report it, and read the limits again: another window may have set them."""
        folder = self._folder
        self._dialog.show_fault(why)
        job = Job(lambda _: read_supervision(folder), self)
        job.start(self._selection.set_supervision)

    def _on_saved(self, supervision: Supervision) -> None:
        self._dialog.close()
        self._selection.set_supervision(supervision)
        self._archive_writer.enter_owed()
