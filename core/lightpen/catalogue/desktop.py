"""Messages of the desktop program: code, then template with named values."""

MESSAGES = {
    "desktop-entry.refused": "{path} cannot be changed: {reason}. Check the write permission.",
    "desktop-entry.not-linux": "Desktop entries exist on Linux only. On Windows the installer creates the start menu entry.",
    "file.settings": "settings file",
    "file.machine-settings": "file of settings for all users",
    "machine-settings.wrong": "The settings for all users in {file} are wrong and were left out: {why}. Ask the administrator to correct the file.",
    "file.update": "file that names the newest version",
    "machine-settings.no-version": 'The file {file} names no version, such as {{"version": "1.1.0"}}. Ask the administrator to correct it.',
    "machine-settings.update": "Version {version} of Lightpen is available. {text}",
    "settings.damaged": "The settings {file} are damaged and were renamed to {aside}. Restore them from a copy, or enter the settings again.",
    "settings.held": "Settings saved, but another program had locked {file} for {seconds:g} s. End that program if it hangs; it may overwrite the settings.",
    "settings.unwritable": "Settings not saved: {file} cannot be written ({reason}). Check free space and write permission of its folder.",
}
