"""The program with its window and commands, put together and started."""
