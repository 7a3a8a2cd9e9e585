"""An extension with a face; without Qt, which commands do not wait for."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from lightpen.extension import Extension

if TYPE_CHECKING:
    from lightpen_app.face import Service
    from lightpen_app.work.workbench import Workbench

Face: TypeAlias = "Callable[[Workbench], Service]"
"""What an extension adds to the window: makes its service for a workbench."""


class Faced(NamedTuple):
    """An extension that adds to the window, too."""

    extension: Extension
    load: Callable[[], Face]  # imports it
