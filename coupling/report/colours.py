"""Colours of the reports' figures, on light and on dark ground."""

from __future__ import annotations

# Colours that stay apart for colour-blind eyes (Okabe and Ito).
BEFORE, AFTER, GREEN, PLANT = "#D55E00", "#0072B2", "#009E73", "#CC79A7"
# Of what a command leaves if the file is right, beside what is to be expected of it.
AS_FILED = "#56B4E9"
DESIRED, QUIET = "#333333", "#999999"
# One for each of six joints, by number.
JOINTS = (AFTER, BEFORE, GREEN, PLANT, AS_FILED, "#E69F00", DESIRED)
# The same on dark ground, where they would be too dark to be seen; the page's script draws with them.
ON_DARK = {
    DESIRED: "#d5dbe1",
    QUIET: "#8b95a0",
    AFTER: "#3c93d0",
    AS_FILED: "#b3e0ff",
    BEFORE: "#ff8a3c",
    GREEN: "#2fbf93",
    PLANT: "#e39cc4",
}
