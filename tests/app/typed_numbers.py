"""Numbers typed as a user does."""

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from lightpen_app.widgets.number_field import NumberField


def type_number(field: NumberField, typed: float | str) -> None:
    """Replace the number of a field and press Enter."""
    field.selectAll()
    QTest.keyClicks(field, f"{typed}")
    QTest.keyClick(field, Qt.Key.Key_Return)
