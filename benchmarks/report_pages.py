"""Weight of report pages, and when they show their first picture and all of it.

    python -m benchmarks.report_pages results/cone/report.html ...

The first picture is the browser's first contentful paint, of a page from the disk in headless Chromium
with WebGL on the processor; each page is opened three times, the fastest counts.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))

from browser import chromium, opened

_TIMES = 3
_PAINT = "return performance.getEntriesByName('first-contentful-paint')[0]?.startTime"


def main() -> None:
    """Print a line for each page that is named."""
    print(f"{'page':40} {'MB':>6} {'first picture':>14} {'in space':>9} {'all':>6}  [ms]")
    for page in map(Path, sys.argv[1:]):
        best = [float("inf")] * 3
        for _ in range(_TIMES):
            with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as driver:
                opened(driver, page.resolve(), 1440)
                names = ("scene", "drawn")
                shown = [
                    driver.execute_script(f"return document.documentElement.dataset.{name}")
                    for name in names
                ]
                times = [driver.execute_script(_PAINT), *shown]
            values = [float(time) if time not in (None, "none") else best[0] for time in times]
            best = [min(pair) for pair in zip(best, values, strict=True)]
        size = page.stat().st_size / 1e6
        print(f"{str(page)[-40:]:40} {size:6.2f} {best[0]:14.0f} {best[1]:9.0f} {best[2]:6.0f}")


if __name__ == "__main__":
    main()
