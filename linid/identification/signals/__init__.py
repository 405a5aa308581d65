"""What recordings show of motion and inputs, and how noisy it is."""
