"""What PySide keeps of the items of layouts, and crashes by.

A layout that is put into another one, or into a widget, after it was filled gets a
Python object for each of its items, which lasts as long as the layout. Qt deletes such
an item when its widget leaves, without a word to PySide. What is made at its place in
memory later is taken for the item when Qt deletes that, and the program ends by a
segmentation fault in `BindingManager::releaseWrapper` (PySide 6.11).
"""

from PySide6.QtWidgets import QSpacerItem, QWidgetItem
from shiboken6 import Shiboken

ITEMS = frozenset({QWidgetItem, QSpacerItem})


def forget_layout_items() -> None:
    """Have PySide forget the items of layouts; nobody may use such an object later."""
    for each in Shiboken.getAllValidWrappers():
        if type(each) in ITEMS:
            Shiboken.invalidate(each)
