"""The shape of every file that users write (TOML) and that the package writes (JSON), one typed class a file.

``toml_file`` reads TOML into these classes, ``typed`` turns what does not fit into one clear line. Nothing else validates
a key.
"""
