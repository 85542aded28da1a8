"""The reducer model: parameters, play operators, modules and their registry."""
