"""Material values from test structures (coupons): which to print, what their readings say, and what they will say."""
