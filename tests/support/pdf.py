"""The words of a PDF, read page by page as they are asked for: parsing a page with figures takes a third of a second."""

import io
from collections.abc import Sequence

import pypdf


class Pages(Sequence):
    """The texts of a PDF's pages with all white space as single blanks; ``reader`` knows the rest of the file."""

    def __init__(self, data: bytes):
        self.reader, self._found = pypdf.PdfReader(io.BytesIO(data)), {}

    def __len__(self):
        return len(self.reader.pages)

    def __getitem__(self, page):
        if isinstance(page, slice):
            return [self[i] for i in range(*page.indices(len(self)))]
        if page not in self._found:
            self._found[page] = " ".join(self.reader.pages[page].extract_text().split())
        return self._found[page]

    @property
    def text(self) -> str:
        """The words of all pages."""
        return " ".join(self)
