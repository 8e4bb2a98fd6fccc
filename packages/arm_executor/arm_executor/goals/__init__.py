"""A goal from its admission to its report: rules, belt, plans, placing, judging."""
