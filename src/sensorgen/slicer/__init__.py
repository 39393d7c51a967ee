"""The slicers: their profiles, in their own formats."""
