"""One physical effect per file, each offering ``EFFECT``; the folder is the catalogue."""
