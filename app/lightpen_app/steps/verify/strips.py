"""What is touched, of which size and how often: a strip of fields for each task."""

from collections.abc import Sequence
from dataclasses import replace

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.verification.choices import Surface, TaskKind, VerificationChoices
from lightpen.verification.fixed_point import MIN_TOUCHES
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.translated import Translated

MOST_TOUCHES, MOST_RUNS = 50, 20
LONGEST, LARGEST_U = 10_000.0, 1.0  # mm


class TaskStrip(Translated, QWidget):
    """Whether a task is done, and what it needs; the fields are those of a subclass.

    Signals
    -------
    value_changed()
        The user chose otherwise.
    """

    value_changed = Signal()

    def __init__(
        self, kind: TaskKind, fields: Sequence[QWidget], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._kind = kind
        self._value = VerificationChoices()
        self._fields = tuple(fields)

        # Widgets
        self._is_chosen = QCheckBox()
        self._labels = tuple(map(_label, self._fields))

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._is_chosen, 0, Qt.AlignmentFlag.AlignBottom)
        for label, field in zip(self._labels, self._fields, strict=True):
            column = QVBoxLayout()
            column.setSpacing(GRID // 2)
            column.addWidget(label)
            column.addWidget(field)
            layout.addLayout(column)
        layout.addStretch(1)

        # Connections
        self._is_chosen.toggled.connect(self._on_changed)
        for field in self._fields:
            if isinstance(field, NumberField):
                field.setKeyboardTracking(False)
                field.valueChanged.connect(self._on_changed)
            elif isinstance(field, ChoiceField):
                field.activated.connect(self._on_changed)

        self._retranslate()

    def value(self) -> VerificationChoices:
        """Return all choices, with those of this strip."""
        kinds = set(self._value.kinds) - {self._kind}
        if self._is_chosen.isChecked():
            kinds.add(self._kind)
        ordered = tuple(kind for kind in TaskKind if kind in kinds)
        return self._with_fields(replace(self._value, kinds=ordered))

    def set_value(self, choices: VerificationChoices) -> None:
        """Show other choices."""
        self._value = choices
        blocked = self.blockSignals(True)
        self._is_chosen.setChecked(self._kind in choices.kinds)
        self._show_fields(choices)
        self.blockSignals(blocked)

    def _with_fields(self, choices: VerificationChoices) -> VerificationChoices:
        raise NotImplementedError

    def _show_fields(self, choices: VerificationChoices) -> None:
        raise NotImplementedError

    def _words(self) -> tuple[str, ...]:
        """Return what the box says, and the names of the fields."""
        raise NotImplementedError

    def _on_changed(self) -> None:
        self._value = self.value()
        self.value_changed.emit()

    @override
    def _retranslate(self) -> None:
        box, *names = self._words()
        self._is_chosen.setText(box)
        for name, label, field in zip(names, self._labels, self._fields, strict=True):
            label.setText(name)
            field.setAccessibleName(name)


class FixedPointStrip(TaskStrip):
    """The cone: how often it is touched."""

    def __init__(self, parent: QWidget | None = None) -> None:
        self._touches = NumberField("", (MIN_TOUCHES, MOST_TOUCHES), 0)
        super().__init__(TaskKind.FIXED_POINT, (self._touches,), parent)

    @override
    def _with_fields(self, choices: VerificationChoices) -> VerificationChoices:
        return replace(choices, n_touches=round(self._touches.value()))

    @override
    def _show_fields(self, choices: VerificationChoices) -> None:
        self._touches.setValue(choices.n_touches)

    @override
    def _words(self) -> tuple[str, ...]:
        return self.tr("Touch the cone again"), self.tr("Touches")


class SurfaceField(ChoiceField):
    """Where something is touched; as wide as its longest choice."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setSizeAdjustPolicy(ChoiceField.SizeAdjustPolicy.AdjustToContents)
        for surface in Surface:
            self.addItem("", surface)

    @override
    def minimumSizeHint(self) -> QSize:
        # WORKAROUND for Qt 6: its own is kept from the language before.
        return self.sizeHint()


class RingStrip(TaskStrip):
    """A ring: its certified radius, where it is touched, and how often."""

    def __init__(self, parent: QWidget | None = None) -> None:
        self._radius = _length_field()
        self._uncertainty = NumberField("mm", (0.0, LARGEST_U), 4)
        self._surface = SurfaceField()
        self._runs = NumberField("", (1, MOST_RUNS), 0)
        fields = self._radius, self._uncertainty, self._surface, self._runs
        super().__init__(TaskKind.CIRCLE, fields, parent)

    @override
    def _with_fields(self, choices: VerificationChoices) -> VerificationChoices:
        return replace(
            choices,
            radius=self._radius.value(),
            radius_uncertainty=self._uncertainty.value(),
            surface=Surface(self._surface.currentData()),
            n_runs=round(self._runs.value()),
        )

    @override
    def _show_fields(self, choices: VerificationChoices) -> None:
        self._radius.setValue(choices.radius)
        self._uncertainty.setValue(choices.radius_uncertainty)
        self._surface.setCurrentIndex(self._surface.findData(choices.surface))
        self._runs.setValue(choices.n_runs)

    @override
    def _words(self) -> tuple[str, ...]:
        names = self.tr("in a groove"), self.tr("in its bore"), self.tr("from outside")
        for index, name in enumerate(names):
            self._surface.setItemText(index, name)
        self._radius.setSpecialValueText(self.tr("not known"))
        return (
            self.tr("Touch a ring"),
            self.tr("Certified radius"),
            self.tr("Its U (k = 2)"),
            self.tr("Touched"),
            self.tr("Runs"),
        )


class ArticulationStrip(TaskStrip):
    """One point in five postures, which needs nothing to be known."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(TaskKind.ARTICULATION, (), parent)

    @override
    def _with_fields(self, choices: VerificationChoices) -> VerificationChoices:
        return choices

    @override
    def _show_fields(self, choices: VerificationChoices) -> None:
        """It has no fields."""

    @override
    def _words(self) -> tuple[str, ...]:
        return (self.tr("Touch the cone five times in each of five postures"),)


class DriftStrip(TaskStrip):
    """A cone as witness that the camera stands still, which needs nothing else."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(TaskKind.DRIFT, (), parent)

    @override
    def _with_fields(self, choices: VerificationChoices) -> VerificationChoices:
        return choices

    @override
    def _show_fields(self, choices: VerificationChoices) -> None:
        """It has no fields."""

    @override
    def _words(self) -> tuple[str, ...]:
        return (self.tr("Touch the cone before, between and after the other tasks"),)


class LengthStrip(TaskStrip):
    """A length: its certified size, and at how many places it is touched."""

    def __init__(self, parent: QWidget | None = None) -> None:
        self._length = _length_field()
        self._uncertainty = NumberField("mm", (0.0, LARGEST_U), 4)
        self._surface = SurfaceField()
        self._places = NumberField("", (1, MOST_RUNS), 0)
        fields = self._length, self._uncertainty, self._surface, self._places
        super().__init__(TaskKind.LENGTH, fields, parent)

    @override
    def _with_fields(self, choices: VerificationChoices) -> VerificationChoices:
        return replace(
            choices,
            length=self._length.value(),
            length_uncertainty=self._uncertainty.value(),
            length_surface=Surface(self._surface.currentData()),
            n_places=round(self._places.value()),
        )

    @override
    def _show_fields(self, choices: VerificationChoices) -> None:
        self._length.setValue(choices.length)
        self._uncertainty.setValue(choices.length_uncertainty)
        self._surface.setCurrentIndex(self._surface.findData(choices.length_surface))
        self._places.setValue(choices.n_places)

    @override
    def _words(self) -> tuple[str, ...]:
        names = self.tr("in cones"), self.tr("inner faces"), self.tr("outer faces")
        for index, name in enumerate(names):
            self._surface.setItemText(index, name)
        self._length.setSpecialValueText(self.tr("not known"))
        return (
            self.tr("Touch both ends"),
            self.tr("Certified length"),
            self.tr("Its U (k = 2)"),
            self.tr("Touched"),
            self.tr("Places"),
        )


def _length_field() -> NumberField:
    return NumberField("mm", (0.0, LONGEST), 4)


def _label(field: QWidget) -> QLabel:
    label = text_label(TextSize.SMALL, Tone.QUIET)
    label.setWordWrap(False)
    label.setBuddy(field)
    return label
