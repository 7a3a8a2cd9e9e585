"""Verification of tips and measurement of parts in the window."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.measure.extension import MEASURE as CORE


def _load() -> "Face":
    from lightpen_app_extensions.measure.face import MeasureFace

    return MeasureFace


MEASURE = Faced(CORE, _load)
