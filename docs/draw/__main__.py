"""Draw every drawing of the documentation anew: ``python docs/draw [FOLDER]``."""

import sys
from pathlib import Path

import indicators
import look
import models

if __name__ == "__main__":
    if sys.argv[1:]:
        look.OUT = Path(sys.argv[1])
    look.OUT.mkdir(exist_ok=True)
    for draw in (*indicators.ALL, *models.ALL):
        draw()
