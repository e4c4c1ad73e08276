"""Ring controllers that were written from the documents alone, and campaigns against them."""
