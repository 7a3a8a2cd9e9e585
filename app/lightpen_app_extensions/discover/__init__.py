"""Tip, pen and camera from a swing without files: captured, solved, saved."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.discover.extension import DISCOVER as CORE


def _load() -> "Face":
    from lightpen_app_extensions.discover.service import DiscoverService

    return DiscoverService


DISCOVER = Faced(CORE, _load)
