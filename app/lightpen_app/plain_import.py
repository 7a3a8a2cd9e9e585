"""Python's own import in place of PySide's hook."""

import builtins


def use_plain_import() -> None:
    """Remove PySide's hook from the import function.

    It reads the source of the module for the sake of `__feature__`, which is not used
    here; that is a fifth of the time of all imports.
    """
    import PySide6.QtCore  # noqa: F401  # replaces the import as it is imported

    builtins.__import__ = vars(builtins).get("__orig_import__", builtins.__import__)
