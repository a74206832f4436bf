"""`python -m kinelast` is the deflection-report command."""

import sys

from kinelast.cli import main

if __name__ == "__main__":
    sys.exit(main())
