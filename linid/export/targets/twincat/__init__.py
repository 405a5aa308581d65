"""TwinCAT: a feed-forward as a function block, and the friction table of TF5200."""

from linid.export.targets.twincat.target import TARGET as TARGET
