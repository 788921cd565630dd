"""Who simulates the samples of a study."""

from __future__ import annotations

import os
from dataclasses import dataclass


@dataclass(frozen=True)
class Workers:
    """Who does the work.

    Attributes:
        count: Processes of a local cluster, one thread each.
        scheduler: Address of a running cluster's scheduler; empty: a local cluster.
    """

    count: int = os.cpu_count() or 1
    scheduler: str = ""
