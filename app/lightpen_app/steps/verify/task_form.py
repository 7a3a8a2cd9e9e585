"""Form of a task: its selection and options, derived from the task."""

from msgspec import structs
from PySide6.QtCore import QSize, Signal
from PySide6.QtWidgets import QCheckBox, QWidget
from typing_extensions import override

from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.tasks.registry import TASKS, AnyTask
from lightpen.verification.tasks.task import (
    NumberOption,
    Option,
    Surface,
    SurfaceOption,
)
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.translated import Translated

MOST_BESIDE = 4  # fields beside each other


class NumberOptionField(NumberField):
    """A number among the options of a task."""

    def __init__(self, option: NumberOption) -> None:
        super().__init__(option.unit, (option.least, option.most), option.decimals)
        self._option = option

    def chosen(self) -> float:
        """Return the number; a count is whole."""
        return self.value() if self._option.decimals else round(self.value())

    def show_chosen(self, number: float) -> None:
        """Show another number."""
        self.set_value(number)

    def retranslate(self) -> None:
        """Translate its texts."""
        self.set_empty_text(worded(self._option.unknown))


class SurfaceField(ChoiceField):
    """Which surface is touched; as wide as its longest choice."""

    def __init__(self, option: SurfaceOption) -> None:
        super().__init__()
        self._option = option
        self.setSizeAdjustPolicy(ChoiceField.SizeAdjustPolicy.AdjustToContents)
        for surface in Surface:
            self.addItem("", surface)

    @override
    def minimumSizeHint(self) -> QSize:
        # WORKAROUND for Qt 6: its own is kept from the language before.
        return self.sizeHint()

    def chosen(self) -> Surface:
        """Return the surface."""
        return Surface(self.currentData())

    def show_chosen(self, surface: Surface) -> None:
        """Show another surface."""
        self.setCurrentIndex(self.findData(surface))

    def retranslate(self) -> None:
        """Translate its texts."""
        for index, label in enumerate(self._option.labels):
            self.setItemText(index, worded(label))


class TaskForm(Translated, QWidget):
    """Shows whether a task is selected, and its options."""

    value_changed = Signal()  # the user chose otherwise

    def __init__(self, task: AnyTask, *beside: QWidget) -> None:
        super().__init__()
        self._task = task
        self._value = VerificationChoices()

        # Widgets
        self._is_chosen = QCheckBox()
        self._options = [each for each in task.fields if each.label is not None]
        self._fields = {each.name: _field_of(each) for each in self._options}
        self._labels = tuple(
            text_label(TextSize.SMALL, Tone.QUIET) for _ in self._fields
        )

        # Layout
        rows = vertical_layout(self)
        horizontal_layout(rows, self._is_chosen, 1, *beside)
        pairs = list(zip(self._labels, self._fields.values(), strict=True))
        for first in range(0, len(pairs), MOST_BESIDE):
            layout = horizontal_layout(rows, spacing=2 * GRID)
            for label, field in pairs[first : first + MOST_BESIDE]:
                label.setWordWrap(False)
                label.setBuddy(field)
                vertical_layout(layout, label, field, spacing=GRID // 2)
            layout.addStretch(1)

        # Connections
        self._is_chosen.toggled.connect(self._on_changed)
        for field in self._fields.values():
            if isinstance(field, NumberOptionField):
                field.value_changed.connect(self._on_changed)
            else:
                field.activated.connect(self._on_changed)

        self._is_chosen.setVisible(task in TASKS)  # a part is not a selectable task
        self._retranslate()

    def value(self) -> VerificationChoices:
        """Return the options of all tasks, with the entries of this form."""
        is_chosen = self._is_chosen.isChecked()
        choices = self._value.with_task(self._task, is_chosen=is_chosen)
        values = {name: field.chosen() for name, field in self._fields.items()}
        options = structs.replace(choices.options_of(self._task), **values)
        return choices.with_options(options)

    def set_value(self, choices: VerificationChoices) -> None:
        """Show other choices."""
        self._value = choices
        options = choices.options_of(self._task)
        blocked = self.blockSignals(True)
        self._is_chosen.setChecked(self._task.kind in choices.kinds)
        for name, field in self._fields.items():
            field.show_chosen(getattr(options, name))
        self.blockSignals(blocked)

    def _on_changed(self) -> None:
        self._value = self.value()
        self.value_changed.emit()

    @override
    def _retranslate(self) -> None:
        purpose = worded(self._task.purpose)
        self._is_chosen.setText(self.tr("Include: {0}").format(purpose))
        fields = self._fields.values()
        for option, label, field in zip(
            self._options, self._labels, fields, strict=True
        ):
            label.setText(worded(option.label))
            field.setAccessibleName(worded(option.label))
            field.retranslate()


def _field_of(option: Option) -> NumberOptionField | SurfaceField:
    if isinstance(option, NumberOption):
        return NumberOptionField(option)
    return SurfaceField(option)
