"""Messages of the desktop program: code, then template with named values."""

MESSAGES = {
    "desktop-entry.refused": "{path} cannot be changed: {reason}. Check the write permission.",
    "desktop-entry.not-linux": "Desktop entries exist on Linux only. On Windows the installer creates the start menu entry.",
    "file.settings": "settings file",
    "settings.damaged": "The settings {file} are damaged and were renamed to {aside}. Restore them from a copy, or enter the settings again.",
    "settings.held": "Settings saved, but another program had locked {file} for {seconds:g} s. End that program if it hangs; it may overwrite the settings.",
    "settings.unwritable": "Settings not saved: {file} cannot be written ({reason}). Check free space and write permission of its folder.",
}
