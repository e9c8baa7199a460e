"""feeler: insect-like tactile sensors in simulation."""
