"""The errors that cross the package's door: each is one clear line."""


class BadInput(ValueError):
    """Input that cannot be used: where it is, what was expected, what was found.

    Commands print it as one line on standard error and exit with code 2.
    """

    def __init__(self, where, expected, found):
        self.where, self.expected, self.found = str(where), str(expected), str(found)
        super().__init__(" ".join(f"{self.where}: expected {self.expected}, found {self.found}".split()))

    def __reduce__(self):
        return type(self), (self.where, self.expected, self.found)


class MissingExtra(ImportError):
    """An optional dependency that the asked-for feature needs is not installed."""

    def __init__(self, feature, package, extra):
        super().__init__(f"{feature} needs the package '{package}': pip install 'backdrive-bayes[{extra}]'")
