"""What the house said before issue 18 was begun, and that it says the same today."""
