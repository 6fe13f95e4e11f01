"""Reference values of every part and model: what scripts/reference_values.py writes to tests/reference."""

from mpmath import mp

# What is written has 17 digits. Differences lose half of these, other cancellations up to 40 more.
DIGITS = 120
mp.dps = DIGITS
