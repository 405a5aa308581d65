"""What each command does by the public interface, with files."""
