"""Programs of others that check what bufferstand writes: what they are asked, where they are (.ci/peers)."""
