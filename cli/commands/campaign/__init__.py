"""Commands that plan, run and watch a campaign."""
