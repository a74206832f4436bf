"""The structure of a mechanism: text, data and skeleton diagram."""
