"""What the pages hold in compressed form."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any


def drawn_in(page: str) -> dict[str, Any]:
    """Return the figures of a page by their names: data and layout of each."""
    packed = re.search(r'id="figures">([^<]*)<', page)
    assert packed
    return json.loads(gzip.decompress(base64.b64decode(packed[1])))
