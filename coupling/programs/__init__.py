"""Robot programs as text: what the makers' languages say, written and read back."""
