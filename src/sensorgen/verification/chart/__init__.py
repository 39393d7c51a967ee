"""Speed against accuracy of our models and of other programs, on scenes of known answers and for a design."""
