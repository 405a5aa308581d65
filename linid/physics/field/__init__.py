"""Magnets and coils: the field of a guideway and what a winding feels in it, from dimensions."""
