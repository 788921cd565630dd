"""Results as HTML pages that open without a network, and on the terminal."""
