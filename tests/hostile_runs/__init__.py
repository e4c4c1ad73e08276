"""Run files that somebody made to do harm, or that time has damaged: each is refused in one sentence."""
