"""What is assumed of a station where its files say nothing, shown and changed."""

from dataclasses import replace
from typing import NamedTuple

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QGridLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from lightpen.model.assumptions import (
    COLDEST,
    USUAL,
    WARMEST,
    Assumptions,
    with_focal_length,
)
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.translated import Translated


class _AssumedNumber(NamedTuple):
    """A field: its unit, of which so many are one of the core's, and its range."""

    name: str
    unit: str
    times: float
    limits: tuple[float, float]
    n_decimals: int


UNMEASURED = COLDEST  # degrees C, at which the field says that nothing was measured
KINDS = (
    _AssumedNumber("focal_length", "%", 1e2, (0.01, 10.0), 2),
    _AssumedNumber("scale", "ppm", 1e6, (0.1, 10_000.0), 1),
    _AssumedNumber("form_error", "\N{MICRO SIGN}m", 1e3, (0.01, 100.0), 2),
    _AssumedNumber("center_bias", "px", 1.0, (0.0001, 1.0), 4),
    _AssumedNumber("temperature_c", "\N{DEGREE SIGN}C", 1.0, (UNMEASURED, WARMEST), 1),
    _AssumedNumber("temperature", "K", 1.0, (0.01, 20.0), 2),
    _AssumedNumber("warmth", "K", 1.0, (0.01, 50.0), 2),
    _AssumedNumber("expansion", "ppm/K", 1e6, (0.0, 100.0), 1),
)


class AssumptionsDialog(Translated, QDialog):
    """Standard uncertainties that stand in for what camera and LED file leave out.

    Signals
    -------
    value_changed()
        The user chose others; they are in force at once.
    """

    value_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value = USUAL

        # Widgets
        self._lead = text_label(TextSize.BODY)
        self._fields = {
            kind.name: NumberField(kind.unit, kind.limits, kind.n_decimals)
            for kind in KINDS
        }
        self._labels: dict[str, QLabel] = {}
        for name, field in self._fields.items():
            label = text_label(TextSize.SMALL, Tone.QUIET)
            label.setBuddy(field)
            self._labels[name] = label
        self._buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.RestoreDefaults
            | QDialogButtonBox.StandardButton.Close
        )

        # Layout
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * GRID)
        grid.setVerticalSpacing(GRID)
        grid.setColumnStretch(0, 1)
        for row, (name, field) in enumerate(self._fields.items()):
            grid.addWidget(self._labels[name], row, 0)
            grid.addWidget(field, row, 1)
        layout = QVBoxLayout(self)
        margin = 3 * GRID
        layout.setContentsMargins(margin, margin, margin, margin)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._lead)
        layout.addLayout(grid)
        layout.addWidget(self._buttons)
        self.setMinimumWidth(70 * GRID)

        # Connections
        for field in self._fields.values():
            field.setKeyboardTracking(False)
            field.valueChanged.connect(self._on_field_changed)
        self._buttons.rejected.connect(self.reject)
        restore = QDialogButtonBox.StandardButton.RestoreDefaults
        self._buttons.button(restore).clicked.connect(self._on_restore_clicked)

        self.set_value(self._value)
        self._retranslate()

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
            field.setValue(UNMEASURED if value is None else kind.times * value)
            field.blockSignals(blocked)
        self._show_which_temperature()

    def _on_field_changed(self) -> None:
        typed = {
            kind.name: self._fields[kind.name].value() / kind.times for kind in KINDS
        }
        focal_length = typed.pop("focal_length")
        temperature = typed.pop("temperature_c")
        measured = None if temperature == UNMEASURED else temperature
        others = replace(self._value, **typed)
        self._value = replace(
            with_focal_length(others, focal_length), temperature_c=measured
        )
        self._show_which_temperature()
        self.value_changed.emit()

    def _on_restore_clicked(self) -> None:
        self.set_value(USUAL)
        self.value_changed.emit()

    def _show_which_temperature(self) -> None:
        """Offer the uncertainty of what was measured, or how warm it may be."""
        is_measured = self._value.temperature_c is not None
        self._fields["temperature"].setEnabled(is_measured)
        self._fields["warmth"].setEnabled(not is_measured)

    def _retranslate(self) -> None:
        self.setWindowTitle(self.tr("Assumptions of the station"))
        self._lead.setText(
            self.tr(
                "Standard uncertainties (k = 1) where the files of camera and LEDs "
                "state none. The next swing uses them, and its result marks what rests "
                "on them."
            )
        )
        self._fields["temperature_c"].setSpecialValueText(self.tr("not measured"))
        texts = {
            "focal_length": self.tr(
                "Focal length; the rest of the camera goes with it"
            ),
            "scale": self.tr("Scale of the LEDs"),
            "form_error": self.tr("Ball and cone, as they are not quite round"),
            "center_bias": self.tr("LED centres, by what does not average out"),
            "temperature_c": self.tr("Temperature of the pen during the swing"),
            "temperature": self.tr("Uncertainty of this temperature"),
            "warmth": self.tr("How much warmer than at its measurement, not measured"),
            "expansion": self.tr("Thermal expansion of the pen"),
        }
        for kind in KINDS:
            text, field = texts[kind.name], self._fields[kind.name]
            self._labels[kind.name].setText(text)
            field.setAccessibleName(text)
            usual = getattr(USUAL, kind.name)
            if usual is not None:
                told = f"{kind.times * usual:g} {kind.unit}"
                field.setToolTip(self.tr("Usual: {0}.").format(told))
