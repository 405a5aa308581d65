"""Terms of the user's own: a formula, checked and translated into a program that the compiled simulation reads."""
