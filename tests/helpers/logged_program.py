"""An external process that logs when it begins and ends: path.csv in, wrench.csv out, a wall on springs.

Its argument is the time that it works [s]; log.txt is beside it.  It needs nothing but Python itself.
"""

import csv
import hashlib
import os
import sys
import time
from pathlib import Path


def tell(log: Path, what: str, asked: bytes) -> None:
    """Append a line; one write at the end of a file is whole, whoever else writes there."""
    line = f"{what} {hashlib.sha256(asked).hexdigest()}\n"
    number = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(number, line.encode())
    os.close(number)


def main() -> None:
    log, seconds = Path(__file__).with_name("log.txt"), float(sys.argv[1])
    asked = Path("path.csv").read_bytes()
    tell(log, "begin", asked)
    time.sleep(seconds)
    with Path("wrench.csv").open("w", newline="") as answer:
        answer.write("time,fx,fy,fz,mx,my,mz\n")
        for row in csv.DictReader(asked.decode().splitlines()):
            force = 2e5 * max(-float(row["z"]), 0.0)
            answer.write(f"{row['time']},0,0,{force!r},0,0,0\n")
    tell(log, "end", asked)


if __name__ == "__main__":
    main()
