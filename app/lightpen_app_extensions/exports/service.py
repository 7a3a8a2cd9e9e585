"""Tips for other programs in the window."""

from typing import TYPE_CHECKING

from typing_extensions import override

from lightpen_app.face import Service

if TYPE_CHECKING:
    from lightpen.record.exports import ExportFormat


class ExportsService(Service):
    """Adds formats to the menu of the step Review that saves results."""

    @override
    def export_formats(self) -> "tuple[ExportFormat, ...]":
        # It takes long to be imported.
        from lightpen_extensions.exports.formats import MORE_FORMATS

        return MORE_FORMATS
