"""How long tests of the window wait for what must come."""

import os

# On a machine that does other things besides, .ci/run sets more.
PATIENCE_MS = 1000 * int(os.environ.get("LIGHTPEN_PATIENCE_S", "20"))
