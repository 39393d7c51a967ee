"""The slicers: their profiles, in their own formats."""

TIME_LIMIT_S = 1800.0  # that a slicer may take when nobody says otherwise
