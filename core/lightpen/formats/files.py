"""Files read whole within a limit, and written whole or not at all."""

import contextlib
import errno
import os
import re
import stat
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.file_locks import folder_locked
from lightpen.formats.part_files import part_of, renamed, sweep_parts
from lightpen.formats.system_reasons import strerror
from lightpen.sentences import Sentence, sentence

MEGABYTE = 1_000_000  # bytes
A_FILE = sentence("file.file", "file")  # of no kind that a user knows
FOLDER = sentence("file.folder", "folder")
PATIENCE = 2.0  # s for another program to give a file its name
EXCERPT_LENGTH = 40  # characters of a file's content quoted in a sentence

_CONTROL = r"[\x00-\x08\x0b\x0e-\x1f\x7f]"
_DENIED = sentence(
    "write.denied", "permission is denied. Choose another folder, or ask for access."
)
_REASONS = {
    errno.ENOSPC: sentence(
        "write.disk-full",
        "the disk is full. Free some space, or write to another disk.",
    ),
    errno.EDQUOT: sentence(
        "write.quota-used-up",
        "your disk quota is used up. Free some space, or write elsewhere.",
    ),
    errno.EFBIG: sentence(
        "write.larger-than-allowed",
        "the file would be larger than allowed here. Write to another disk.",
    ),
    errno.EACCES: _DENIED,
    errno.EPERM: _DENIED,
    errno.EROFS: sentence(
        "write.read-only", "the disk is read-only. Choose another folder."
    ),
    errno.ENOENT: sentence(
        "write.no-folder",
        "its folder does not exist. Create the folder, or choose another.",
    ),
    errno.ENOTDIR: sentence(
        "write.not-a-folder", "its folder is not a folder. Check the path."
    ),
    errno.ENAMETOOLONG: sentence(
        "write.name-too-long", "the name is too long. Choose a shorter one."
    ),
    errno.ELOOP: sentence(
        "write.link-loop",
        "the name is a link that leads back to itself. Choose another name.",
    ),
    errno.EEXIST: sentence(
        "write.name-taken", "there is a file of that name already. Try again."
    ),
}
# What a disk answers that gives a file one name only: FAT, and some of the network.
_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)


def read_bytes(path: Path, what: Sentence, limit: int) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    what : Sentence
        What the file is, for the sentences: "camera file".
    limit : int
        Largest size, bytes. It is checked before anything is read.

    Raises
    ------
    FileError
        The file is missing, a folder, empty, unreadable or larger than `limit`.
    """
    with opened(path, what, limit) as stream:
        # Of a longer read, all that it may bring is asked for in advance.
        return stream.read(os.fstat(stream.fileno()).st_size)


@contextlib.contextmanager
def opened(path: Path, what: Sentence, limit: int) -> Iterator[BinaryIO]:
    """Open a file to be read, having looked at what it is.

    Parameters
    ----------
    what, limit
        As for `read_bytes`.

    Raises
    ------
    FileError
        As for `read_bytes`, also while it is read.
    """
    shown = printable(str(path))
    try:
        _check_readable(_status(path, what), what, shown, limit)
        with path.open("rb") as stream:
            _check_readable(os.fstat(stream.fileno()), what, shown, limit)
            yield stream
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FileError(
            sentence(
                "read.missing",
                "The {what} {path} does not exist. Check the name and the folder.",
                what=what,
                path=shown,
            )
        ) from error
    except OSError as error:
        raise unreadable(path, what, error) from error


def read_text(path: Path, what: Sentence, limit: int) -> str:
    r"""Return the content of a text file, with ``\n`` at the line ends.

    UTF-8 with or without byte order mark, UTF-16 with one, and Windows-1252, which
    old instruments write in comments.

    Parameters
    ----------
    what : Sentence
        What the file is, for the sentences.
    limit : int
        Largest size, bytes.

    Raises
    ------
    FileError
        As `read_bytes`, or the file is not text.
    """
    data = read_bytes(path, what, limit)
    shown = printable(str(path))
    try:
        text = _decode(data)
    except UnicodeDecodeError as error:
        raise FileError(
            sentence(
                "read.no-known-encoding",
                "The {what} {path} is not text: byte {byte} fits no known encoding. "
                "Check that the right file is named, or save it as UTF-8.",
                what=what,
                path=shown,
                byte=error.start + 1,
            )
        ) from error
    control = re.search(_CONTROL, text)
    if control:
        line = text.count("\n", 0, control.start()) + 1
        raise FileError(
            sentence(
                "read.control-character",
                "The {what} {path} is not text: line {line} holds the control "
                "character {character}. Check that the right file is named, or save "
                "it as UTF-8.",
                what=what,
                path=shown,
                line=line,
                character=ord(control[0]),
            )
        )
    if not text.strip():
        raise FileError(
            sentence(
                "read.blank",
                "The {what} {path} holds nothing but blanks. Save it again.",
                what=what,
                path=shown,
            )
        )
    return text.replace("\r\n", "\n").replace("\r", "\n")


def write_whole(path: Path, data: bytes) -> None:
    """Write a file whole, or leave what was there untouched.

    The data goes to a new file in the same folder, which takes the place of the old
    one only when all of it is on the disk; what a write that was killed has left there
    is removed. Pipes and devices are written straight to.

    Raises
    ------
    FileError
        The file cannot be written; the text says why and what to do.
    """
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            path.write_bytes(data)
        else:
            _replace(Path(os.path.realpath(path)), data)
    except IsADirectoryError as error:
        raise FileError(
            sentence(
                "write.onto-folder",
                "{path} cannot be written: it is a folder. Name a file.",
                path=printable(str(path)),
            )
        ) from error
    except OSError as error:
        raise _unwritten(path, error) from error


def create_whole(path: Path, data: bytes) -> None:
    """Write a new file whole, or none; a file that has the name stays as it is.

    When this returns, the file is on the disk with its name, whatever happens next.

    Raises
    ------
    NameTakenError
        The file exists.
    FileError
        The file cannot be written; the text says why and what to do.
    """
    sweep_parts(path.parent)
    try:
        with part_of(path, data) as part:
            _name_anew(part, path)
        try:
            sync_folder(path.parent)
        except OSError:
            path.unlink()
            raise
    except FileExistsError as error:
        raise NameTakenError(_unwritten(path, error).sentence) from error
    except OSError as error:
        raise _unwritten(path, error) from error


def sync_folder(folder: Path) -> None:
    """Put the names in a folder on the disk, where the system can (not Windows).

    Raises
    ------
    OSError
        The disk fails.
    """
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def unreadable(path: Path, what: Sentence, error: OSError) -> FileError:
    """Return the error of a file or folder, ``what`` it is, that cannot be read."""
    return FileError(
        sentence(
            "read.failed",
            "The {what} {path} cannot be read: {reason}. Check that it is yours to "
            "read and that its disk is connected.",
            what=what,
            path=printable(str(path)),
            reason=strerror(error),
        )
    )


def sha256(path: Path) -> str:
    """Return the SHA-256 digest of a file's content, in hexadecimal digits.

    Raises
    ------
    FileError
        The file cannot be read.
    """
    import hashlib  # 3 ms that a start of the program need not take

    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise FileError(
            sentence(
                "hash.failed",
                "The file {path} cannot be read: {reason}. Check the name and that it "
                "is yours to read.",
                path=printable(str(path)),
                reason=strerror(error),
            )
        ) from error


def printable(text: str) -> str:
    """Return a text with every unprintable character written as its code."""
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() else ascii(character)[1:-1]
        for character in text
    )


def quoted(text: str) -> str:
    """Return the start of a file's content in quotes, fit to be shown to the user."""
    start = text[:EXCERPT_LENGTH]
    return f'"{printable(start)}{"..." if len(text) > len(start) else ""}"'


def why_unwritten(error: OSError) -> Sentence:
    """Return why a file cannot be written, and what to do, as a whole sentence."""
    other = sentence(
        "write.other-reason",
        "{reason}. Choose another folder or name.",
        reason=strerror(error),
    )
    return _REASONS.get(error.errno or 0, other)


def _status(path: Path, what: Sentence) -> os.stat_result:
    try:
        return path.stat()
    except ValueError as error:  # a null character in it, or half a letter
        raise FileError(
            sentence(
                "read.no-name",
                "The {what} {path} has a name that no file can have. Check the name.",
                what=what,
                path=printable(str(path)),
            )
        ) from error


def _check_readable(
    status: os.stat_result, what: Sentence, path: str, limit: int
) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise FileError(
            sentence(
                "read.folder",
                "The {what} {path} is a folder. Name the file itself.",
                what=what,
                path=path,
            )
        )
    if not stat.S_ISREG(status.st_mode):
        raise FileError(
            sentence(
                "read.device",
                "The {what} {path} is a pipe or a device. Name a file on a disk.",
                what=what,
                path=path,
            )
        )
    if status.st_size == 0:
        raise FileError(
            sentence(
                "read.empty",
                "The {what} {path} is empty. Check how it was saved or copied.",
                what=what,
                path=path,
            )
        )
    if status.st_size > limit:
        raise _too_large(what, path, status.st_size, limit)


def _too_large(what: Sentence, path: str, size: int, limit: int) -> FileError:
    return FileError(
        sentence(
            "read.too-large",
            "The {what} {path} has {size:.1f} MB, more than the {limit:g} MB such a "
            "file may have. Check that the right file is named.",
            what=what,
            path=path,
            size=size / MEGABYTE,
            limit=limit / MEGABYTE,
        )
    )


def _decode(data: bytes) -> str:
    if data.startswith(BOM_UTF8):
        return data.decode("utf-8-sig")
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def _replace(target: Path, data: bytes) -> None:
    if target.is_symlink():  # still, after all that can be followed was
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
    if mode is not None and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    sweep_parts(target.parent)
    with part_of(target, data) as part:
        if mode is not None:
            part.chmod(mode)
        renamed(part.replace, target)


def _name_anew(part: Path, target: Path) -> None:
    """Give a file its name, unless another has it."""
    if os.name != "posix":
        renamed(part.rename, target)  # Windows refuses to replace a file
        return
    try:
        target.hardlink_to(part)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        _rename_anew(part, target)


def _rename_anew(part: Path, target: Path) -> None:
    """Do so on a disk that gives a file one name only, and one program at a time."""
    with folder_locked(target.parent, PATIENCE):
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
        part.rename(target)


def _unwritten(path: Path, error: OSError) -> FileError:
    return FileError(
        sentence(
            "write.failed",
            "{path} cannot be written: {reason} What was there before is unchanged.",
            path=printable(str(path)),
            reason=why_unwritten(error),
        )
    )
