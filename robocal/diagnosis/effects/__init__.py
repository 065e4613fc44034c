"""One physical effect a file; `catalogue.py` beside this folder registers them."""
