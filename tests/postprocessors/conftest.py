import sys
from pathlib import Path

# Tests are imported by path (importlib mode); their shared programs and readers stand beside them.
sys.path.insert(0, str(Path(__file__).parent))
