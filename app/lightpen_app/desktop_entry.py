"""The program in the menu of a Linux desktop, and the files that it opens.

What is written are the files of the freedesktop.org standards, into the user's own data
folder: a desktop entry, the icon, and the type of the file in the folder of each swing.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from lightpen.errors import FileError, UsageError
from lightpen.formats.files import strerror, write_whole
from lightpen_resources import RESOURCES

MIME_TYPE = "application/x-lightpen-swing"
ENTRY = """\
[Desktop Entry]
Type=Application
Version=1.4
Name=Lightpen
Name[zh_CN]=Lightpen 光笔标定
Comment=Calibrate the probe tip of a light pen
Comment[zh_CN]=标定光笔的测头
Exec={program} open %f
TryExec={tried}
Icon=lightpen
Terminal=false
Categories=Science;Engineering;
MimeType={mime_type};
StartupWMClass=lightpen
Actions=new;

[Desktop Action new]
Name=New calibration
Name[zh_CN]=新的标定
Exec={program}
"""
TYPES = f"""\
<?xml version="1.0" encoding="UTF-8"?>
<mime-info xmlns="http://www.freedesktop.org/standards/shared-mime-info">
  <mime-type type="{MIME_TYPE}">
    <comment>Lightpen swing</comment>
    <comment xml:lang="zh_CN">Lightpen 摆动记录</comment>
    <icon name="lightpen"/>
    <glob pattern="*.lightpen"/>
  </mime-type>
</mime-info>
"""
ENTRY_FILE = "applications/lightpen.desktop"
TYPES_FILE = "mime/packages/lightpen.xml"
ICON_FILE = "icons/hicolor/scalable/apps/lightpen.svg"
# What keeps the lists of entries and types, and where; a desktop without them looks
# through the folders itself.
REFRESHERS = {"update-desktop-database": "applications", "update-mime-database": "mime"}


def install_entry() -> int:
    """Write the entry, the icon and the file type on Linux; return the exit status."""
    data = _data_folder()
    program = Path(sys.argv[0]).absolute()  # a link, such as pipx makes, stays one
    entry = ENTRY.format(
        program=_quoted(str(program)), tried=program, mime_type=MIME_TYPE
    )
    icon = (RESOURCES / "icons" / "lightpen.svg").read_bytes()
    contents = {ENTRY_FILE: entry.encode(), TYPES_FILE: TYPES.encode(), ICON_FILE: icon}
    for name, content in contents.items():
        _make_folder((data / name).parent)
        write_whole(data / name, content)
    _refresh(data)
    return 0


def remove_entry() -> int:
    """Remove what `install_entry` wrote; return the exit status."""
    data = _data_folder()
    for name in (ENTRY_FILE, TYPES_FILE, ICON_FILE):
        try:
            (data / name).unlink(missing_ok=True)
        except OSError as error:
            raise _refused(data / name, error) from error
    _refresh(data)
    return 0


def _data_folder() -> Path:
    if not sys.platform.startswith("linux"):
        raise UsageError("desktop-entry.not-linux")
    chosen = os.environ.get("XDG_DATA_HOME", "")
    # By the standard, a path that is not absolute counts as none.
    if Path(chosen).is_absolute():
        return Path(chosen)
    return Path.home() / ".local" / "share"


def _quoted(program: str) -> str:
    """Return a path quoted for the key Exec."""
    escaped = re.sub(r'(["`$\\])', r"\\\1", program).replace("%", "%%")
    return '"' + escaped.replace("\\", "\\\\") + '"'


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _refused(folder, error) from error


def _refused(path: Path, error: OSError) -> FileError:
    return FileError("desktop-entry.refused", path=path, reason=strerror(error))


def _refresh(data: Path) -> None:
    for program, folder in REFRESHERS.items():
        found = shutil.which(program)
        if found is not None and (data / folder).is_dir():
            subprocess.run([found, str(data / folder)], check=False)
