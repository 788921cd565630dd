"""Before the first run of a case: a new one, and what can be said of it without a run."""
