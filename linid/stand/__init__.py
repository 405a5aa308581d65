"""The laboratory stand: an independent plant that generates scope recordings of a described axis."""
