"""What the pages hold in compressed form."""

import base64
import gzip
import json
import re
from typing import Any


def drawn_in(page: str, kind: str = "figures") -> dict[str, Any]:
    """Return the figures of a page by their names, data and layout of each; or its `scenes`."""
    packed = re.search(rf'id="{kind}">([^<]*)<', page)
    assert packed
    return json.loads(gzip.decompress(base64.b64decode(packed[1])))
