"""Sphinx: `sphinx-build -W docs build/docs` (the extra `docs`)."""

from importlib import metadata

project = "linid"
author = copyright = "the linid authors"
release = metadata.version("linid")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode", "sphinx_click", "sphinx-mathjax-offline"]
exclude_patterns = ["figures", "first_steps.ipynb"]
html_theme = "furo"
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
