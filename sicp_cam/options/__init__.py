"""Options from words: converted to their types, and described for the operator."""
