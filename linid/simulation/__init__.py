"""The compiled simulation, and slow twins of it that check it."""
