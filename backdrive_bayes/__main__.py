from backdrive_bayes.commands.main import main

raise SystemExit(main())
