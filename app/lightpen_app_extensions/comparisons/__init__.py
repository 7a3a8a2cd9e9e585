"""Comparisons of calibrations in the window."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.comparisons.extension import COMPARISONS as CORE


def _load() -> "Face":
    from lightpen_app_extensions.comparisons.service import ComparisonsService

    return ComparisonsService


COMPARISONS = Faced(CORE, _load)
