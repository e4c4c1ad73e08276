"""What a clean simulated stand does not have, and a real one does."""
