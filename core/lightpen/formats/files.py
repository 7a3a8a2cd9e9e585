"""Files read within a size limit, and written atomically."""

import contextlib
import errno
import logging
import os
import re
import stat
import tomllib
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import BinaryIO

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.part_files import part_of, renamed, sweep_parts
from lightpen.messages import Message, message, printable

_WORDED = {  # as the C library words them
    errno.EPERM: message("system.not-permitted"),
    errno.ENOENT: message("system.not-there"),
    errno.EIO: message("system.input-output"),
    errno.EACCES: message("system.denied"),
    errno.ENOTDIR: message("system.no-folder"),
    errno.EMFILE: message("system.many-open"),
    errno.ENOSPC: message("system.full"),
    errno.EROFS: message("system.read-only"),
    errno.ENAMETOOLONG: message("system.long-name"),
    errno.ELOOP: message("system.loop"),
    errno.ETIMEDOUT: message("system.timed-out"),
}


def strerror(error: OSError) -> Message | str:
    """Return the reason of an error, by default the system's text."""
    known = _WORDED.get(error.errno or 0)
    return known or error.strerror or type(error).__name__


MEGABYTE = 1_000_000  # bytes
LARGEST_RECORD = 32 * MEGABYTE  # of the own files; 5000 images of 4 cameras take 26
A_FILE = message("file.file")  # of unknown kind
FOLDER = message("file.folder")
EXCERPT_LENGTH = 40  # characters of a file's content quoted in a message

_DEVICES = r"(?i:con|prn|aux|nul|com[0-9\u00b9\u00b2\u00b3]|lpt[0-9\u00b9\u00b2\u00b3])"
_CHINESE = rb"([\xb0-\xf7][\xa1-\xfe]){2}"  # two characters, in GB 2312 and later
_CONTROL = r"[\x00-\x08\x0b\x0e-\x1f\x7f]"
_DENIED = message("write.denied")
_REASONS = {
    errno.ENOSPC: message("write.disk-full"),
    errno.EDQUOT: message("write.quota-used-up"),
    errno.EFBIG: message("write.larger-than-allowed"),
    errno.EACCES: _DENIED,
    errno.EPERM: _DENIED,
    errno.EROFS: message("write.read-only"),
    errno.ENOENT: message("write.no-folder"),
    errno.ENOTDIR: message("write.not-a-folder"),
    errno.ENAMETOOLONG: message("write.name-too-long"),
    errno.ELOOP: message("write.link-loop"),
    errno.EEXIST: message("write.name-taken"),
}
# Errors of file systems without hard links: FAT, some network drives.
_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)

AN_IMAGE = "image"
HEAD = 1000  # bytes, that tell the kind of a file
SEARCHED = 100_000  # bytes, that tell the program

_logger = logging.getLogger(__name__)


def read_bytes(path: Path, what: Message, limit: int) -> bytes:
    """Return the content of a file of at most ``limit`` bytes, checked before reading.

    ``what`` is the file type for messages. Raises `FileError` if the file is missing, a
    folder, empty, unreadable or larger.
    """
    with opened(path, what, limit) as stream:
        # A longer read would allocate the requested size in advance.
        return stream.read(os.fstat(stream.fileno()).st_size)


@contextlib.contextmanager
def opened(path: Path, what: Message, limit: int) -> Iterator[BinaryIO]:
    """Check a file and open it for reading; see `read_bytes`."""
    try:
        _check_readable(_status(path, what), what, path, limit)
        with path.open("rb") as stream:
            _check_readable(os.fstat(stream.fileno()), what, path, limit)
            _logger.debug("read: %s", path)
            yield stream
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FileError("read.missing", what=what, path=path) from error
    except OSError as error:
        raise unreadable(path, what, error) from error


def read_text(path: Path, what: Message, limit: int) -> str:
    r"""Return a text file as `read_bytes`, with ``\n`` at the line ends.

    UTF-8 with or without byte order mark, UTF-16 with one, and GB 18030,
    Windows-1252 or Shift JIS, which old instruments write in comments.
    """
    return text_of(read_bytes(path, what, limit), path, what)


def text_of(data: bytes, path: Path, what: Message) -> str:
    """Return the text of a file of this content; see `read_text`."""
    if kind := kind_of(data):
        raise FileError("read.kind", what=what, path=path, kind=kind)
    try:
        text = _decode(data)
    except UnicodeDecodeError as error:
        raise FileError(
            "read.no-known-encoding", what=what, path=path, byte=error.start + 1
        ) from error
    control = re.search(_CONTROL, text)
    if control:
        line = text.count("\n", 0, control.start()) + 1
        raise FileError(
            "read.control-character",
            what=what,
            path=path,
            line=line,
            character=ord(control[0]),
        )
    if not text.strip():
        raise FileError("read.blank", what=what, path=path)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def kind_of(data: bytes, name: str = "") -> str:
    """Return the kind of a file that is not read here, or ``""``.

    The ending of ``name`` decides first, if it is given, then the first bytes.
    """
    named = foreign_program(os.fsencode(name.lower()), "names")[0] if name else ""
    return named or foreign_program(data[:HEAD])[0]


def foreign_program(data: bytes, content: str = "any") -> tuple[str, str]:
    """Return the program of a file that is not read here, and what to do, or ``""``.

    ``content`` is one of the lists of ``foreign.toml``; any file may be of ``any``.
    """
    text = data[:SEARCHED].removeprefix(BOM_UTF8).decode("latin-1")
    if data.startswith((BOM_UTF16_BE, BOM_UTF16_LE)):
        text = text[2:].replace("\0", "")
    known = _foreign()
    for mark, program, *way in (*known[content], *known["any"]):
        if re.search(mark, text):
            return program, "".join(way)
    return "", ""


@cache
def _foreign() -> dict[str, list[list[str]]]:
    return tomllib.loads(Path(__file__).with_name("foreign.toml").read_text("utf-8"))


def write_whole(path: Path, data: bytes) -> None:
    """Write a file atomically.

    The data goes to a new file in the same folder, which replaces the old one once it
    is completely on the disk; leftovers of killed writes are removed. Pipes and devices
    are written straight to.
    """
    _require_file(path)
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            path.write_bytes(data)
        else:
            _replace(Path(os.path.realpath(path)), data)
        _logger.debug("written: %s", path)
    except IsADirectoryError as error:
        raise FileError("write.onto-folder", path=path) from error
    except OSError as error:
        raise _unwritten(path, error) from error


def require_folder_of(path: Path) -> None:
    """Refuse a file whose folder does not exist, before others are written."""
    if not path.parent.is_dir():
        raise _unwritten(
            path, FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
        )


def create_whole(path: Path, data: bytes, mode: int = 0o666) -> None:
    """Write a new file whole or not at all; raise `NameTakenError` if it exists.

    When this returns, the file is durable under its name. ``mode`` as in `os.open`.
    """
    _require_file(path)
    sweep_parts(path.parent)
    try:
        with part_of(path, data, mode) as part:
            _name_anew(part, path)
        try:
            sync_folder(path.parent)
        except OSError:
            path.unlink()
            raise
        _logger.debug("written: %s", path)
    except FileExistsError as error:
        raise NameTakenError(_unwritten(path, error).message) from error
    except OSError as error:
        raise _unwritten(path, error) from error


def is_reserved(name: str) -> bool:
    """Return whether Windows takes a file name for a device, whatever its suffix."""
    return re.fullmatch(_DEVICES, name.partition(".")[0].rstrip()) is not None


def _require_file(path: Path) -> None:
    """Refuse the name of a device on Windows, which would discard the data."""
    if os.name == "nt" and is_reserved(path.name):
        raise FileError("write.reserved", path=path)


def sync_folder(folder: Path) -> None:
    """Flush the directory entries of a folder to disk (not on Windows)."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def unreadable(path: Path, what: Message, error: OSError) -> FileError:
    """Return the error of an unreadable file or folder of the kind ``what``."""
    return FileError("read.failed", what=what, path=path, reason=strerror(error))


def sha256(path: Path) -> str:
    """Return the SHA-256 digest of a file's content, in hexadecimal digits.

    A pipe or device, which never ends, is refused.
    """
    return start_sha256(path, None)


def start_sha256(path: Path, n_bytes: int | None) -> str:
    """Return the digest of the first bytes of a file; of all if None; as `sha256`."""
    import hashlib  # imported here: it takes 3 ms

    digest = hashlib.sha256()
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise FileError("read.device", what=A_FILE, path=path)
        with path.open("rb") as stream:
            left = n_bytes
            while part := stream.read(
                MEGABYTE if left is None else min(left, MEGABYTE)
            ):
                digest.update(part)
                left = None if left is None else left - len(part)
    except OSError as error:
        raise FileError("hash.failed", path=path, reason=strerror(error)) from error
    return digest.hexdigest()


def quoted(text: str) -> str:
    """Return the start of a file's content, quoted and escaped for display."""
    start = text[:EXCERPT_LENGTH]
    return f'"{printable(start)}{"..." if len(text) > len(start) else ""}"'


def why_unwritten(error: OSError) -> Message:
    """Return why a file cannot be written and what to do."""
    other = message("write.other-reason", reason=strerror(error))
    return _REASONS.get(error.errno or 0, other)


def _status(path: Path, what: Message) -> os.stat_result:
    try:
        return path.stat()
    except ValueError as error:  # null character or lone surrogate
        raise FileError("read.no-name", what=what, path=path) from error


def _check_readable(
    status: os.stat_result, what: Message, path: Path, limit: int
) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise FileError("read.folder", what=what, path=path)
    if not stat.S_ISREG(status.st_mode):
        raise FileError("read.device", what=what, path=path)
    if status.st_size == 0:
        raise FileError("read.empty", what=what, path=path)
    if status.st_size > limit:
        raise FileError(
            "read.too-large",
            what=what,
            path=path,
            size=status.st_size / MEGABYTE,
            limit=limit / MEGABYTE,
        )


def _decode(data: bytes) -> str:
    if data.startswith(BOM_UTF8):
        return data.decode("utf-8-sig")
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        usual = "gb18030" if re.search(_CHINESE, data) else "cp1252"
    with contextlib.suppress(UnicodeDecodeError):
        return data.decode(usual)
    return data.decode("cp932")


def _replace(target: Path, data: bytes) -> None:
    if target.is_symlink():  # a loop of links
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
    """Rename a file unless the target exists."""
    if os.name != "posix":
        renamed(part.rename, target)  # Windows refuses to replace a file
        return
    try:
        target.hardlink_to(part)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        if target.exists():  # on a file system without hard links
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST)) from None
        part.rename(target)


def _unwritten(path: Path, error: OSError) -> FileError:
    return FileError("write.failed", path=path, reason=why_unwritten(error))


@dataclass(frozen=True)
class FileFormat:
    """A format of exported files."""

    name: str  # on the command line
    label: Message
    suffix: str  # end of the names of its files
    text: Callable[..., str]  # content of a file

    def encoded(self, *values: object) -> bytes:
        """Return the content of a file for some values, in UTF-8."""
        return self.text(*values).encode("utf-8", "backslashreplace")


# The mark of a folder with simulated files.
#
# A simulated camera file looks like a real one. Whoever writes simulated files leaves
# this mark beside them, so that what is computed from them is known to be simulated.


MARK = "SIMULATED.txt"
TEXT = "The files in this folder were simulated by Lightpen; they are of no real pen.\n"


def mark_simulated(folder: Path) -> None:
    """Mark a folder."""
    write_whole(folder / MARK, TEXT.encode())


def is_simulated(path: Path) -> bool:
    """Return whether a file, or a folder of images, was simulated.

    Images may be in a subfolder beside the mark. Unreadable folders count as real.
    """
    folders = (path, path.parent, path.parent.parent)
    try:
        return any((folder / MARK).is_file() for folder in folders)
    except (OSError, ValueError):
        return False
