"""Messages of simulator: code, then template with named values."""

MESSAGES = {
    "scene.no-folder": "{reason} The folder {folder} cannot be created or read.",
    "scene.not-empty": "The folder {folder} is not empty: it contains {example}. Choose another folder, or empty it; nothing is overwritten.",
}
