"""Files for the printer: 3MF, slicer profiles and runs, G-code parsed, checked and rewritten."""
