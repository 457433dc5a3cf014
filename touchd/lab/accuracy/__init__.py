"""`touchd bench accuracy`: scenes with exact truth, run with each method, scored and put into tables."""
