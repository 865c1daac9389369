"""Files that people and programs exchange, read with complaints that name the line."""
