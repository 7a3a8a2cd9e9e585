"""The server of a plant in the window."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.plant.extension import PLANT as CORE


def _load() -> "Face":
    from lightpen_app_extensions.plant.service import PlantService

    return PlantService


PLANT = Faced(CORE, _load)
