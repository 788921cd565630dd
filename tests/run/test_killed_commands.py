"""Commands that write several folders, killed at random moments, end as if nobody had disturbed them."""

from __future__ import annotations

import random

import pytest
from killed_commands import KilledCommand, commands


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """Commands by name; each runs where it is asked for."""
    folder = tmp_path_factory.mktemp("killed")
    return folder, commands(folder)


def test_identify_survives_three_rounds_of_kills(known):
    """The others take minutes: `python tests/helpers/killed_commands.py 100`."""
    folder, named = known
    chance = random.Random(3)
    name, words = next(named)
    command = KilledCommand.of(words, folder / f"{name}_undisturbed")
    assert sum(command.round(folder / f"{name}_{k}", chance) for k in range(3)) > 0
