"""Design rules: whether a printer's nozzle and layers can make a scene as it lies on the bed; one or two per file."""
