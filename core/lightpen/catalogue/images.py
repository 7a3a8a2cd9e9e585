"""Messages of image files: code, then template with named values."""

MESSAGES = {
    "image.too-much-memory": "{name} is {width} x {height} px and needs {needed:.0f} MB for decoding; the maximum is {most:.0f} MB. Save the images as grey PNG.",
    "image.value-type": "{name} has values of type {value_type}; grey values of 8 or 16 bit are needed. Save the images without conversion.",
    "image.too-many-scans": "{name} is a JPEG of {n_scans} scans; at most {most} are read. Save the images as PNG.",
    "image.undecodable": "{name} cannot be decoded: {problem}.",
    "image.wrong-checksum": "{name} is damaged (wrong checksum). Capture or copy it again.",
    "image.damaged": "{name} is damaged or not a supported image (PNG, JPEG, BMP, TIFF, PGM, WebP). Capture or copy it again.",
    "image.cut-off": "{name} is cut off. Capture or copy it again.",
    "image.animated": "{name} is an animation. Save its images one by one.",
    "image.too-many-pixels": "{name} is {width} x {height} px; the maximum is {most:,} px. Choose images of the calibrated camera.",
    "image.tiff-compression": "{name} is a TIFF with the compression {compression}, which is not supported. Save the images as PNG, or without compression.",
    "image.frame": "Frame {number} of the video",
    "image.video": "The video {path} cannot be opened or contains no frames. Check that it plays, or save its frames as images.",
    "image.frame-undecodable": "{name} cannot be decoded.",
    "images.empty-folder": "The folder {folder} contains no images ({suffixes}). Choose the folder with the images.",
    "images.nothing-there": "There is no folder, video or image at {place}. Check the name.",
    "video.too-much-memory": "The video {path} cannot be decoded within {most:.0f} MB. Save its frames as images.",
    "video.too-many-frames": "The video {path} has more than {most} frames. Cut out the swing, or save its frames as images.",
    "video.codec": "The video {path} has the unsupported codec {codec}. Save it with FFV1 or MJPG, or save its frames as images.",
    "video.motion-jpeg-only": "The video {path} cannot be read: this installation has no FFmpeg and reads Motion JPEG in .avi files only. Save the video in this form, or save its frames as images.",
    "video.path": "The path of the video {path} is no valid UTF-8, which the video decoder needs. Rename the video or its folder, or copy it elsewhere.",
}
