"""Search spaces: which parameters are searched, within which bounds and on which scale."""
