"""From a case to its run folder."""
