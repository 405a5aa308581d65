"""The page of the paper's reproduction."""
