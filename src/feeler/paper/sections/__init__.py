"""One module per section of the report: compute with the rooms, draw with the figure modules, keep the numbers."""
