"""One file a format, each offers ``FORMAT`` (``logger.exchange.layer``). Its name is the ending of the files."""
