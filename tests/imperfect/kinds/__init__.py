"""What goes wrong with records, a room for each place at which it arises."""
