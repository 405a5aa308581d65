"""One run: its request, folder, checkpoints, files and words on the console."""
