"""Translatable reasons of operating system errors."""

import errno

from lightpen.messages import Message, message

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
