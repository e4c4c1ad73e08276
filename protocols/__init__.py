"""What is to be done, as inspectable data: campaign files, limits, sweeps, and the plan made of them."""
