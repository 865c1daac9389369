"""The examination's modules lie beside its tests; being a program too, they import each other plainly."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
