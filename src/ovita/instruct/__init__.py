"""The built-in reader: from a sentence to a policy without key or network, in milliseconds."""
