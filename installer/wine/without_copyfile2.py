"""A plugin of pytest for Wine, which ends a program that calls CopyFile2.

Without it, Python copies files by itself.
"""

import sys

if sys.platform == "win32":
    import _winapi

    del _winapi.CopyFile2
