"""Camera calibration with boards in the window."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.boards.extension import BOARDS as CORE


def _load() -> "Face":
    from lightpen_app_extensions.boards.service import BoardsService

    return BoardsService


BOARDS = Faced(CORE, _load)
