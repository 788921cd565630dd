"""Whether tests in emulators are asked for: they start slowly, so `make emulators` says so."""

import os

from coupling.native.compiler import zig

EMULATORS = "ELASTIC_ROBOT_EMULATORS" in os.environ and zig() is not None
