"""ABB RAPID: written and read."""
