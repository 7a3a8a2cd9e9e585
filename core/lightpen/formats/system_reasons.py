"""Why the system refuses a file, a folder or a port, to be told in any language."""

import errno

from lightpen.sentences import Sentence, sentence

_REASONS = {  # as the C library words them
    errno.EPERM: sentence("system.not-permitted", "Operation not permitted"),
    errno.ENOENT: sentence("system.not-there", "No such file or directory"),
    errno.EIO: sentence("system.input-output", "Input/output error"),
    errno.EACCES: sentence("system.denied", "Permission denied"),
    errno.ENOTDIR: sentence("system.no-folder", "Not a directory"),
    errno.EMFILE: sentence("system.many-open", "Too many open files"),
    errno.ENOSPC: sentence("system.full", "No space left on device"),
    errno.EROFS: sentence("system.read-only", "Read-only file system"),
    errno.ENAMETOOLONG: sentence("system.long-name", "File name too long"),
    errno.ELOOP: sentence("system.loop", "Too many levels of symbolic links"),
    errno.ETIMEDOUT: sentence("system.timed-out", "Connection timed out"),
}


def strerror(error: OSError) -> Sentence | str:
    """Return why the system refuses; in its own words where these are not known."""
    known = _REASONS.get(error.errno or 0)
    return known or error.strerror or type(error).__name__
