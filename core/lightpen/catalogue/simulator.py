"""Messages of simulator: code, then template with named values."""

MESSAGES = {
    "scene.no-folder": "The folder {folder} cannot be created or read: {reason}",
    "scene.not-empty": "The folder {folder} is not empty: it contains {example}. Choose another folder, or empty it; nothing is overwritten.",
}
