"""The next command from what was measured under the ones before: docs/next.md."""
