"""Files read whole within a limit, and written whole or not at all."""

import contextlib
import errno
import os
import re
import stat
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path

from lightpen.errors import FileError

MEGABYTE = 1_000_000  # bytes
EXCERPT_LENGTH = 40  # characters of a file's content quoted in a sentence

_CONTROL = r"[\x00-\x08\x0b\x0e-\x1f\x7f]"
_REASONS = {
    errno.ENOSPC: "the disk is full. Free some space, or write to another disk.",
    errno.EDQUOT: "your disk quota is used up. Free some space, or write elsewhere.",
    errno.EFBIG: "the file would be larger than allowed here. Write to another disk.",
    errno.EACCES: "permission is denied. Choose another folder, or ask for access.",
    errno.EPERM: "permission is denied. Choose another folder, or ask for access.",
    errno.EROFS: "the disk is read-only. Choose another folder.",
    errno.ENOENT: "its folder does not exist. Create the folder, or choose another.",
    errno.ENOTDIR: "its folder is not a folder. Check the path.",
    errno.ENAMETOOLONG: "the name is too long. Choose a shorter one.",
}


def read_bytes(path: Path, what: str, limit: int) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    path : Path
    what : str
        What the file is, for the sentences: "camera file".
    limit : int
        Largest size, bytes. It is checked before anything is read.

    Raises
    ------
    FileError
        The file is missing, a folder, empty, unreadable or larger than `limit`.
    """
    shown = f"The {what} {printable(str(path))}"
    try:
        status = path.stat()
        _check_readable(status, shown, limit)
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FileError(
            f"{shown} does not exist. Check the name and the folder."
        ) from error
    except OSError as error:
        raise unreadable(path, what, error) from error
    if len(data) > limit:
        raise _too_large(shown, len(data), limit)
    return data


def read_text(path: Path, what: str, limit: int) -> str:
    r"""Return the content of a text file, with ``\n`` at the line ends.

    UTF-8 with or without byte order mark, UTF-16 with one, and Windows-1252, which
    old instruments write in comments.

    Parameters
    ----------
    path : Path
    what : str
        What the file is, for the sentences.
    limit : int
        Largest size, bytes.

    Raises
    ------
    FileError
        As `read_bytes`, or the file is not text.
    """
    data = read_bytes(path, what, limit)
    shown = f"The {what} {printable(str(path))}"
    try:
        text = _decode(data)
    except UnicodeDecodeError as error:
        raise FileError(
            f"{shown} is not text: byte {error.start + 1} fits no known encoding. "
            "Check that the right file is named, or save it as UTF-8."
        ) from error
    control = re.search(_CONTROL, text)
    if control:
        line = text.count("\n", 0, control.start()) + 1
        raise FileError(
            f"{shown} is not text: line {line} holds the control character "
            f"{ord(control[0])}. Check that the right file is named, or save it as "
            "UTF-8."
        )
    if not text.strip():
        raise FileError(f"{shown} holds nothing but blanks. Save it again.")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def write_whole(path: Path, data: bytes) -> None:
    """Write a file whole, or leave what was there untouched.

    The data goes to a new file in the same folder, which takes the place of the old
    one only when all of it is on the disk. Pipes and devices are written straight to.

    Parameters
    ----------
    path : Path
    data : bytes

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
            f"{printable(str(path))} cannot be written: it is a folder. Name a file."
        ) from error
    except OSError as error:
        reason = _REASONS.get(
            error.errno or 0, f"{_strerror(error)}. Choose another folder or name."
        )
        raise FileError(
            f"{printable(str(path))} cannot be written: {reason} What was there "
            "before is unchanged."
        ) from error


def unreadable(path: Path, what: str, error: OSError) -> FileError:
    """Return the error of a file or folder, ``what`` it is, that cannot be read."""
    return FileError(
        f"The {what} {printable(str(path))} cannot be read: {_strerror(error)}. Check "
        "that it is yours to read and that its disk is connected."
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
            f"The file {printable(str(path))} cannot be read: {_strerror(error)}. "
            "Check the name and that it is yours to read."
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


def _check_readable(status: os.stat_result, shown: str, limit: int) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise FileError(f"{shown} is a folder. Name the file itself.")
    if not stat.S_ISREG(status.st_mode):
        raise FileError(f"{shown} is a pipe or a device. Name a file on a disk.")
    if status.st_size == 0:
        raise FileError(f"{shown} is empty. Check how it was saved or copied.")
    if status.st_size > limit:
        raise _too_large(shown, status.st_size, limit)


def _too_large(shown: str, size: int, limit: int) -> FileError:
    return FileError(
        f"{shown} has {size / MEGABYTE:.1f} MB, more than the {limit / MEGABYTE:g} MB "
        "such a file may have. Check that the right file is named."
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
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
    if mode is not None and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    part = target.with_name(f".{os.urandom(8).hex()}.part")
    try:
        with part.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        if mode is not None:
            part.chmod(mode)
        part.replace(target)
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _strerror(error: OSError) -> str:
    return error.strerror or type(error).__name__
