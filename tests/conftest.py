"""What all tests share: speed decides nothing, so no example of a property may fail for the time it took."""

from hypothesis import settings

settings.register_profile("linid", deadline=None)
settings.load_profile("linid")
