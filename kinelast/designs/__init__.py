"""Many designs of one scene: which ones, what they come to, and where that is kept."""
