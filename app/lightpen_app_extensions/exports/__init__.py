"""Tips for other programs in the window."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.exports.extension import EXPORTS as CORE


def _load() -> "Face":
    from lightpen_app_extensions.exports.service import ExportsService

    return ExportsService


EXPORTS = Faced(CORE, _load)
