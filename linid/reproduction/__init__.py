"""The paper's tables, figures and claims, set beside what fits of a generated stand find."""
