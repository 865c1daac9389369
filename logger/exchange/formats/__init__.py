"""One file a format, each offers ``FORMAT`` (``logger.exchange.format``). Its name is the ending of the files."""
