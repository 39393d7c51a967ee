"""Pressed transmission line: checked inputs, derivatives, tanh(z)/z."""
