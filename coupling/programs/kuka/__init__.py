"""KUKA's language: a program's statements are executed as far as they say what they do."""
