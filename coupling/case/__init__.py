"""The case file and what it says: robots, the real plant, a study, a place."""
