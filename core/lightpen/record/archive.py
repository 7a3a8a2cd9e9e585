"""(being written elsewhere)"""

from pathlib import Path

Archive = Path
