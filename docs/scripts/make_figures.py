"""Write the README's picture, the report's first screen in results/cone (make run): make figures."""

import sys
from pathlib import Path

from docs.scripts.page import finish
from docs.scripts.pictures import photograph

REPORT = Path(__file__).parents[2] / "results" / "cone" / "report.html"
WIDTH, HEIGHT = 1120, 820
# The tool stands where the cone is half as deep as it will be [s].
TIME = 70.0
MOVED = f"""<script>
const moved = setInterval(() => {{
  if (!document.documentElement.dataset.drawn) return;
  clearInterval(moved);
  document.scenes.first_scene.seek({TIME});
}}, 50);
</script>"""


def write() -> None:
    """Write the picture."""
    page = REPORT.read_text(encoding="utf-8")
    photograph("cone", page.replace("</body>", f"{MOVED}</body>"), WIDTH, HEIGHT)


if __name__ == "__main__":
    sys.exit(finish(write))
