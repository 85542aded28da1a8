"""`python -m backdrive_bayes` is the command."""

from backdrive_bayes.commands.main import main

raise SystemExit(main())
