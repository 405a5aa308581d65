"""The identified model in other programs' forms: one target, one file; what a simpler form costs is measured."""
