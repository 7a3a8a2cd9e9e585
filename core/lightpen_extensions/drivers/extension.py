"""What this extension adds to the program."""

from lightpen.extension import Extension
from lightpen_extensions.drivers.aravis import ARAVIS
from lightpen_extensions.drivers.genicam import GENICAM
from lightpen_extensions.drivers.webcam import WEBCAM

DRIVERS = Extension("drivers", sources=(GENICAM, ARAVIS, WEBCAM))
