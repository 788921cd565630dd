"""Times of commands by part: each second counts once, and every part is still there."""

import importlib
from functools import reduce

import pytest
from places import ROOT

from benchmarks import command_parts
from benchmarks.command_parts import PARTS, REST, SIMULATIONS, START, PartTimes
from benchmarks.commands import COMMANDS, checkout_of, parts_of, rows_of

# The folder that commands write bytecode into, which takes longer than they do: kept for the next time.
BYTECODE = ROOT / ".pytest_cache" / "bytecode"


def test_a_part_within_another_counts_for_itself_alone(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(command_parts.time, "process_time", lambda: clock[0])

    def works(seconds, *then):
        clock[0] += seconds
        for other in then:
            other()
        clock[0] += seconds

    times = PartTimes()
    inner = times.timed("tables", lambda: works(1.0))
    works(0.5, times.timed(REST, lambda: works(2.0, inner, times.timed(REST, inner))))
    assert times.spent == {START: 0.5, REST: 4.0, "tables": 4.0}


@pytest.mark.parametrize("module", PARTS)
def test_every_part_is_a_function_of_this_checkout(module):
    for name in PARTS[module]:
        assert callable(reduce(getattr, name.split("."), importlib.import_module(module)))


def test_a_command_of_a_checkout_is_timed_from_its_start():
    with checkout_of(str(ROOT)) as checkout:
        assert checkout == ROOT
        times = parts_of(checkout, "start", BYTECODE)
    assert times[START] > 0.1
    assert set(times) <= {START, REST, SIMULATIONS}
    with pytest.raises(RuntimeError, match=r"m\.csv: cannot be read"):
        parts_of(ROOT, "next", BYTECODE)


def test_the_table_has_the_sum_first_and_what_is_in_one_alone():
    lines = rows_of("check cone", {START: 2.0, "page": 1.0}, {START: 1.0, "tables": 0.5})
    assert lines[0] == ("check cone", "all", "3.00", "1.50", "0.50")
    assert ("", "page", "1.00", "0.00", "0.00") in lines
    assert ("", "tables", "0.00", "0.50", "") in lines
    assert "check cone" in COMMANDS
