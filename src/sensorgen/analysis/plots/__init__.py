"""Figures: described once as data, drawn as pictures or on a page for the browser."""
