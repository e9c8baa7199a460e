"""What the gradient of stiffness does."""
