"""Writing FMUs: model description, documentation, archive."""
