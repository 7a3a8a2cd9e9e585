"""The program with its window: all extensions, put together here alone."""

from lightpen_app.face import Face
from lightpen_app_extensions.boards.service import BoardsService
from lightpen_app_extensions.discover.service import DiscoverService
from lightpen_app_extensions.exports.service import ExportsService
from lightpen_app_extensions.measure.face import MeasureFace
from lightpen_app_extensions.plant.service import PlantService
from lightpen_app_extensions.stream.service import StreamService

FACES: tuple[Face, ...] = (  # each after what it needs
    MeasureFace,
    BoardsService,
    DiscoverService,
    ExportsService,
    PlantService,
    StreamService,
)
