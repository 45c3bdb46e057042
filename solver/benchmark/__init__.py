"""Speed of the solver on declared cases, alone and beside peer engines."""
