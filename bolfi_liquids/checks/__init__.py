"""The command `check sbc`."""
