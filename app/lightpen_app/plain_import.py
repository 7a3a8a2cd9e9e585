"""Python's own import instead of that of PySide."""

import builtins


def use_plain_import() -> None:
    """Take back what PySide does after each import.

    It reads the source of the module for the sake of `__feature__`, which is not used
    here; that is a fifth of the time of all imports.
    """
    import PySide6.QtCore  # noqa: F401  # replaces the import as it is imported

    builtins.__import__ = vars(builtins).get("__orig_import__", builtins.__import__)
