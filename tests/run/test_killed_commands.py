"""Commands that write several folders, killed at random moments, end as if nobody had disturbed them."""

from __future__ import annotations

import random

import pytest
from killed_commands import KilledCommand, commands


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    folder = tmp_path_factory.mktemp("killed")
    return folder, commands(folder)


@pytest.mark.parametrize("name", ["identify", "place", "next", "learn"])
def test_a_command_survives_a_round_of_kills(known, name):
    """A hundred rounds: `python tests/helpers/killed_commands.py 25`."""
    folder, words = known
    command = KilledCommand.of(words[name], folder / f"{name}_undisturbed")
    command.round(folder / name, random.Random(3))
