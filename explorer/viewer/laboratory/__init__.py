"""The tab "Laboratory": bench readings, photographs, users' own designs, audits of published studies."""
