"""Where a result is entered in the archive beside it, which is only read."""

from contextlib import closing, suppress
from pathlib import Path

from lightpen.errors import FileError, NoArchiveError
from lightpen.formats.files import printable
from lightpen.record.folder_archive import FolderArchive
from lightpen.record.opening import data_folder_of
from lightpen.record.statement import Entered
from lightpen.sentences import sentence


def entry_of_file(result: Path, sha256: str) -> Entered | None:
    """Return where a result is entered.

    Parameters
    ----------
    sha256 : str
        Of the file as it was read.

    Returns
    -------
    Entered or None
        None of a file in no data folder, and of one that is not entered yet.

    Raises
    ------
    ArchiveError
        The archive is there, but cannot be read.
    FileError
        It is not the file that was entered.
    """
    data = data_folder_of(result)
    if data is None:
        return None
    # A fifth of a second, which a file in no data folder need not take.
    from lightpen.archive.chains import chain_at_home, entry_of_result
    from lightpen.archive.database import look_into
    from lightpen.archive.logbook import ARCHIVE

    found = None
    with (
        suppress(NoArchiveError),
        closing(look_into(data / ARCHIVE)) as database,
    ):
        if chain := chain_at_home(database):
            place = FolderArchive(data).place_of(result)
            found = entry_of_result(database, chain, place)
    if found is None:
        return None
    entered = found.entry.event.result
    if entered is None or entered.sha256 != sha256:
        raise FileError(
            sentence(
                "archive.another-result",
                "The result {file} is not the one that was entered in the archive: it "
                "was changed since. Restore it from a copy.",
                file=printable(str(result)),
            )
        )
    return Entered(found.entry.number, found.sha256, found.entry.previous)
