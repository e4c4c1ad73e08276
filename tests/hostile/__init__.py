"""Files and clients that mean harm, or are broken: one message each, in bounded time, no traceback."""
