"""Limits and default uncertainties of a station, and their dialogs."""

from dataclasses import replace
from typing import NamedTuple

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QLabel, QLineEdit, QWidget
from typing_extensions import override

from lightpen.model.limits import (
    COLDEST,
    LIMITS,
    USUAL,
    WARMEST,
    Assumptions,
    Limit,
    StationLimits,
    with_focal_length,
)
from lightpen.record.library.supervision import (
    Signature,
    Supervision,
    read_supervision,
    save_limits,
)
from lightpen_app.look.layouts import fill, grid_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import phrases_whole
from lightpen_app.widgets.fields import (
    ChoiceField,
    SupervisorFields,
    Translated,
    core_text,
)
from lightpen_app.widgets.fitting import DialogScroll, FittedWindow
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
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
        self._refresh()

    def show_fault(self, fault: str) -> None:
        """Show why nothing was saved."""
        self._is_signed = False
        self._fault.set_value(StatusMessage.fault(fault))
        self._supervisor.clear_password()

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
    def _refresh(self) -> None:
        self._save.setEnabled(self._supervisor.is_filled() and not self._is_signed)
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


class _AssumedNumber(NamedTuple):
    """A number field: its unit, units per unit of the core, and its range."""

    name: str
    unit: str
    times: float
    limits: tuple[float, float]
    n_decimals: int


# At which a field says that nothing was measured.
UNMEASURED = {"temperature_c": COLDEST, "humidity_percent": 0.0}
KINDS = (
    _AssumedNumber("focal_length", "%", 1e2, (0.01, 10.0), 2),
    _AssumedNumber("scale", "ppm", 1e6, (0.1, 10_000.0), 1),
    _AssumedNumber("form_error", "\N{MICRO SIGN}m", 1e3, (0.01, 100.0), 2),
    _AssumedNumber("center_bias", "px", 1.0, (0.0001, 1.0), 4),
    _AssumedNumber("temperature_c", "\N{DEGREE SIGN}C", 1.0, (COLDEST, WARMEST), 1),
    _AssumedNumber("temperature", "K", 1.0, (0.01, 20.0), 2),
    _AssumedNumber("humidity_percent", "%", 1.0, (0.0, 100.0), 0),
    _AssumedNumber("warmth", "K", 1.0, (0.01, 50.0), 2),
    _AssumedNumber("expansion", "ppm/K", 1e6, (0.0, 100.0), 1),
)


class AssumptionsDialog(FittedWindow, Translated, QDialog):
    """Default uncertainties for what camera and LED files do not state."""

    value_changed = Signal()  # changed by the user; applies at once

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.say(self, self.tr("Default uncertainties of the station"))
        self._value = USUAL

        # Widgets
        self._lead = self.say(
            text_label(TextSize.BODY),
            self.tr(
                "Standard uncertainties (k = 1) used where the intrinsics file and "
                "the LED file state none. They apply from the next swing; its "
                "result marks the assumed values."
            ),
        )
        self._fields = {
            kind.name: NumberField(kind.unit, kind.limits, kind.n_decimals)
            for kind in KINDS
        }
        texts = (
            self.tr("Focal length (other intrinsics scaled with it)"),
            self.tr("Scale of the LED coordinates"),
            self.tr("Form error of ball and cone"),
            self.tr("Systematic error of LED centres"),
            self.tr("Pen temperature during the swing"),
            self.tr("Uncertainty of this temperature"),
            self.tr("Relative humidity (for the report)"),
            self.tr("Temperature difference from LED measurement (if not measured)"),
            self.tr("Thermal expansion of the pen"),
        )
        self._buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.RestoreDefaults
            | QDialogButtonBox.StandardButton.Close
        )

        # Layout
        layout = vertical_layout(self, self._lead, spacing=2 * GRID, margins=3 * GRID)
        fields, scroll = QWidget(), DialogScroll()
        grid = grid_layout(fields, spacing=(2 * GRID, GRID))
        grid.setColumnStretch(0, 1)
        for row, (kind, text) in enumerate(zip(KINDS, texts, strict=True)):
            field, usual = self._fields[kind.name], getattr(USUAL, kind.name)
            default = "" if usual is None else f"{kind.times * usual:g} {kind.unit}"
            tip = self.tr("Default: {0}.").format(default) if default else ""
            label = self.make_label(field, text, tip=tip)
            label.setWordWrap(True)
            if kind.name in UNMEASURED:
                self.say(field, hint=self.tr("not measured"), name=text)
            grid.addWidget(label, row, 0)
            grid.addWidget(field, row, 1)
        scroll.setWidget(fields)
        fill(layout, (scroll, 1), self._buttons)
        self.setMinimumWidth(70 * GRID)

        # Connections
        for field in self._fields.values():
            field.value_changed.connect(self._on_field_changed)
        self._buttons.rejected.connect(self.reject)
        restore = QDialogButtonBox.StandardButton.RestoreDefaults
        self._buttons.button(restore).clicked.connect(self._on_restore_clicked)

        self.set_value(self._value)

    def value(self) -> Assumptions:
        """Return the assumptions."""
        return self._value

    def set_value(self, assumptions: Assumptions) -> None:
        """Show other assumptions."""
        self._value = assumptions
        for kind in KINDS:
            value = getattr(assumptions, kind.name)
            field = self._fields[kind.name]
            blocked = field.blockSignals(True)
            field.set_value(
                UNMEASURED[kind.name] if value is None else kind.times * value
            )
            field.blockSignals(blocked)
        self._show_which_temperature()

    def _on_field_changed(self) -> None:
        typed: dict[str, float | None] = {}
        for kind in KINDS:
            value = self._fields[kind.name].value()
            is_known = value != UNMEASURED.get(kind.name)
            typed[kind.name] = value / kind.times if is_known else None
        focal_length = typed.pop("focal_length")
        assert focal_length is not None
        changed = replace(self._value, **typed)  # type: ignore[arg-type]
        self._value = with_focal_length(changed, focal_length)
        self._show_which_temperature()
        self.value_changed.emit()

    def _on_restore_clicked(self) -> None:
        self.set_value(USUAL)
        self.value_changed.emit()

    def _show_which_temperature(self) -> None:
        """Show the uncertainty of a measured temperature, or of the assumed one."""
        is_measured = self._value.temperature_c is not None
        self._fields["temperature"].setEnabled(is_measured)
        self._fields["warmth"].setEnabled(not is_measured)
