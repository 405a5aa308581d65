"""What people read: tables, figures, files and the page."""
