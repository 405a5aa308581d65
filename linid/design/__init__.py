"""The motor from its magnets and coils, beside one that a fit has found."""
