"""The limits of a station, laid down by a supervisor."""

from dataclasses import fields, replace

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QGridLayout,
    QLabel,
    QLineEdit,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.model.due_rule import MOST_DAYS, MOST_SWINGS, DueRule
from lightpen.model.limits import StationLimits, VerificationLimits
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.start.form import LEAST_IMAGES, MOST_IMAGES
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.supervisor_fields import SupervisorFields
from lightpen_app.widgets.translated import Translated

SMALLEST, LARGEST = 0.0001, 10.0  # mm
SWING = ("max_uncertainty", "min_images", "max_images")
VERIFICATION = tuple(item.name for item in fields(VerificationLimits))
DUE = {"max_days": (1, MOST_DAYS), "max_swings": (0, MOST_SWINGS)}


class LimitsDialog(Translated, QDialog):
    """Shows limits; who signs as a supervisor lays others down.

    Signals
    -------
    signed(StationLimits, Signature, str)
        Limits to be laid down, who signs, and a new password or none.
    """

    signed = Signal(object, object, str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value = StationLimits()
        self._is_guarded = False
        self._is_signed = False  # and waits for what comes of it

        # Widgets
        self._lead = text_label(TextSize.BODY)
        counts = (LEAST_IMAGES, MOST_IMAGES)
        self._fields = {
            name: NumberField("", counts, 0)
            if name.endswith("images")
            else NumberField("mm", (SMALLEST, LARGEST), 4)
            for name in (*SWING, *VERIFICATION)
        }
        self._fields |= {name: NumberField("", most, 0) for name, most in DUE.items()}
        self._labels: dict[str, QLabel] = {}
        for name, field in self._fields.items():
            label = text_label(TextSize.SMALL, Tone.QUIET)
            label.setBuddy(field)
            self._labels[name] = label
        self._signing = text_label(TextSize.SMALL, Tone.QUIET)
        self._supervisor = SupervisorFields()
        self._new_password = QLineEdit()
        self._new_password.setEchoMode(QLineEdit.EchoMode.Password)
        self._trouble = SignLabel()
        standard = QDialogButtonBox.StandardButton
        self._buttons = QDialogButtonBox(standard.Save | standard.Close)
        self._save = self._buttons.button(standard.Save)

        # Layout
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * GRID)
        grid.setVerticalSpacing(GRID // 2)
        for column in (0, 2):
            grid.setColumnStretch(column, 1)
        n_rows = (len(self._fields) + 1) // 2
        for index, (name, field) in enumerate(self._fields.items()):
            column, row = divmod(index, n_rows)
            grid.addWidget(self._labels[name], row, 2 * column)
            grid.addWidget(field, row, 2 * column + 1)
        layout = QVBoxLayout(self)
        margin = 3 * GRID
        layout.setContentsMargins(margin, margin, margin, margin)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._lead)
        layout.addLayout(grid)
        layout.addWidget(self._signing)
        layout.addWidget(self._supervisor)
        layout.addWidget(self._new_password)
        layout.addWidget(self._trouble)
        layout.addWidget(self._buttons)
        self.setMinimumWidth(96 * GRID)

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
        typed = {name: field.value() for name, field in self._fields.items()}
        least, most = sorted(round(typed[name]) for name in SWING[1:])
        swing = replace(
            self._value.swing,
            max_uncertainty=typed["max_uncertainty"],
            min_images=least,
            max_images=most,
        )
        own = {name: typed[name] for name in VERIFICATION}
        due = DueRule(*(round(typed[name]) for name in DUE))
        return StationLimits(swing, VerificationLimits(**own), due)

    def set_value(self, limits: StationLimits, *, is_guarded: bool) -> None:
        """Show limits, and whether there is a password already."""
        self._value, self._is_guarded = limits, is_guarded
        for part, names in (
            (limits.swing, SWING),
            (limits.verification, VERIFICATION),
            (limits.due, DUE),
        ):
            for name in names:
                self._fields[name].setValue(getattr(part, name))
        self._supervisor.clear()
        self._new_password.clear()
        self._new_password.setVisible(is_guarded)
        self._is_signed = False
        self._trouble.set_value(Remark())
        self._retranslate()
        self._refresh()

    def tell(self, trouble: str) -> None:
        """Say why nothing was laid down."""
        self._is_signed = False
        self._trouble.set_value(Remark(trouble, Sign.CROSS, Tone.BAD))
        self._supervisor.clear_password()

    def _refresh(self) -> None:
        self._save.setEnabled(self._supervisor.is_filled() and not self._is_signed)

    def _on_entered(self) -> None:
        if self._save.isEnabled():
            self._on_save_clicked()

    def _on_save_clicked(self) -> None:
        self._is_signed = True
        self._refresh()
        new = self._new_password.text()
        self.signed.emit(self.value(), self._supervisor.value(), new)

    @override
    def _retranslate(self) -> None:
        self.setWindowTitle(self.tr("Limits of the station"))
        self._lead.setText(
            self.tr(
                "What lies beyond them, only a supervisor can accept, with a reason. "
                "Each change is kept with name and time."
            )
        )
        self._signing.setText(
            self.tr("Sign with the supervisor's password.")
            if self._is_guarded
            else self.tr(
                "There is no password yet: the one that you type becomes the "
                "supervisor's. From then on it is asked for."
            )
        )
        self._save.setText(self.tr("Lay down"))
        close = QDialogButtonBox.StandardButton.Close
        self._buttons.button(close).setText(self.tr("Close"))
        new = self.tr("New password, or nothing to keep it")
        self._new_password.setPlaceholderText(new)
        self._new_password.setAccessibleName(new)
        texts = {
            "max_uncertainty": self.tr("Swing: U (k = 2) at most"),
            "min_images": self.tr("Swing: images at least"),
            "max_images": self.tr("Swing: images at most"),
            "across": self.tr("Fixed point: std across the view"),
            "along": self.tr("Fixed point: std along the view"),
            "radius": self.tr("Ring: error of the radius"),
            "form": self.tr("Ring: roundness, and off its plane"),
            "length": self.tr("Length: error"),
            "location": self.tr("Location error"),
            "repeatability": self.tr("Repeatability: std of the tip"),
            "drift": self.tr("Drift of a witness"),
            "max_days": self.tr("Tips: days in force at most"),
            "max_swings": self.tr("Tips: swings of their pen at most"),
        }
        self._fields["max_swings"].setSpecialValueText(self.tr("any number"))
        usual = StationLimits()
        parts = {
            **dict.fromkeys(SWING, usual.swing),
            **dict.fromkeys(VERIFICATION, usual.verification),
            **dict.fromkeys(DUE, usual.due),
        }
        for name, field in self._fields.items():
            self._labels[name].setText(texts[name])
            field.setAccessibleName(texts[name])
            number = getattr(parts[name], name)
            usually = f"{number:g}" if number else self.tr("any number")
            field.setToolTip(self.tr("Usual: {0}.").format(usually))
