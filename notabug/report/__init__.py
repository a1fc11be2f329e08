"""The report: a page drawn from run.json, its pictures beside it or in it, and what build servers take."""
