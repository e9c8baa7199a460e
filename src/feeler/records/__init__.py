"""Records, checked arguments and open sets: what a value may be, and words for what it is not."""
