"""The JSON files that commands leave, as models: written and read by the same classes."""
