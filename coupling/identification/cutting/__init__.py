"""Cutting coefficients and run-out from slots under a dynamometer."""
