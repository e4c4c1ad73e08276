"""The desk: served by the real command, asked over real sockets, looked at with real Chromium."""
