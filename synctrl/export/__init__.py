"""Results as data for other tools: tables, labelled arrays, MATLAB, netCDF, and recordings.

`Quantity` (`quantities.py`) says what each array of a result means, entry by entry; every format is written
from these.
"""
