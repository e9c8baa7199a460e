"""What was found with the library: the paper, figure by figure, and the questions beyond it."""
