"""What a verdict of the diagnosis says: on the console, in files and in words."""
