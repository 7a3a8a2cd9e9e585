"""The live stream in the window."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.stream.extension import STREAM as CORE


def _load() -> "Face":
    from lightpen_app_extensions.stream.service import StreamService

    return StreamService


STREAM = Faced(CORE, _load)
