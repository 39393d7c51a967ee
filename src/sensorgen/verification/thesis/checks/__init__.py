"""Checks of the numbered items of the thesis, by topic: functions that give parts to be judged."""
