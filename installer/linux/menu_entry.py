"""Write the program into the menu of a Linux desktop: ``menu_entry.py SHARE PROGRAM``.

What is written into the folder SHARE, such as ``/usr/share``, are the files of the
freedesktop.org standards: a desktop entry that starts PROGRAM, the icon, and the type
of the file in the folder of each swing. Needs the standard library alone.
"""

import re
import sys
from pathlib import Path

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
ICON = "resources/lightpen_resources/icons/lightpen.svg"


def write_menu_entry(share: Path, program: Path) -> None:
    """Write the entry, the icon and the file type."""
    entry = ENTRY.format(
        program=_quoted(str(program)), tried=program, mime_type=MIME_TYPE
    )
    icon = (Path(__file__).resolve().parents[2] / ICON).read_bytes()
    contents = {ENTRY_FILE: entry.encode(), TYPES_FILE: TYPES.encode(), ICON_FILE: icon}
    for name, content in contents.items():
        (share / name).parent.mkdir(parents=True, exist_ok=True)
        (share / name).write_bytes(content)


def _quoted(program: str) -> str:
    """Return a path quoted for the key Exec."""
    escaped = re.sub(r'(["`$\\])', r"\\\1", program).replace("%", "%%")
    return '"' + escaped.replace("\\", "\\\\") + '"'


if __name__ == "__main__":
    write_menu_entry(*map(Path, sys.argv[1:]))
