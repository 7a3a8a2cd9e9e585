"""Default uncertainties of a station, and their dialog."""

from dataclasses import replace
from typing import NamedTuple

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QGroupBox, QWidget

from lightpen.model.assumptions import (
    COLDEST,
    USUAL,
    WARMEST,
    Assumptions,
    with_focal_length,
)
from lightpen_app.look.layouts import (
    fill,
    grid_layout,
    horizontal_layout,
    vertical_layout,
)
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.page_scroll import DialogScroll
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


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
        typed = {
            kind.name: self._fields[kind.name].value() / kind.times for kind in KINDS
        }
        focal_length = typed.pop("focal_length")
        measured = {
            name: None if (value := typed.pop(name)) == nothing else value
            for name, nothing in UNMEASURED.items()
        }
        others = with_focal_length(replace(self._value, **typed), focal_length)
        self._value = replace(
            others,
            temperature_c=measured["temperature_c"],
            humidity_percent=measured["humidity_percent"],
        )
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


class AssumptionsPanel(Translated, QGroupBox):
    """Opens the default uncertainties of a station."""

    value_changed = Signal()  # the user chose other assumptions

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Default uncertainties"))

        # Widgets
        self._words = text_label(TextSize.SMALL, Tone.QUIET)
        self._change = self.say(
            PushButton(),
            self.tr("Change"),
            name=self.tr("Change the default uncertainties"),
            tip=self.tr(
                "Focal length, scale, temperature, form of ball and cone: "
                "uncertainty where no file states it."
            ),
        )
        self.dialog = AssumptionsDialog(self)

        # Layout
        horizontal_layout(self, (self._words, 1), self._change, spacing=2 * GRID)

        # Connections
        self._change.clicked.connect(self.dialog.open)
        self.dialog.value_changed.connect(self._on_dialog_changed)

        self._retranslate()

    def value(self) -> Assumptions:
        """Return the assumptions."""
        return self.dialog.value()

    def set_value(self, assumptions: Assumptions) -> None:
        """Show other assumptions."""
        self.dialog.set_value(assumptions)
        self._retranslate()

    def _on_dialog_changed(self) -> None:
        self._retranslate()
        self.value_changed.emit()

    def _retranslate(self) -> None:
        self._words.setText(
            self.tr("Default values are used where a file states no uncertainty.")
            if self.value() == USUAL
            else self.tr(
                "Values of this station are used where a file states no uncertainty."
            )
        )
