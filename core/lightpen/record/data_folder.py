"""Whether anything can be kept in the folder that holds swings and results."""

import os
from pathlib import Path
from tempfile import TemporaryFile

from lightpen.errors import FileError
from lightpen.formats.files import printable, why_unwritten
from lightpen.sentences import sentence


def check_writable(data: Path) -> None:
    """Write to a folder, which is made if it is not there, and leave nothing in it.

    Raises
    ------
    FileError
        It cannot be written; the text says why and what to do.
    """
    try:
        data.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=data) as file:
            file.write(b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise FileError(
            sentence(
                "data-folder.unwritable",
                "Nothing can be kept in the data folder {folder}: {reason}",
                folder=printable(str(data)),
                reason=why_unwritten(error),
            )
        ) from error
