"""Studies of measured test rigs that anybody can download."""
