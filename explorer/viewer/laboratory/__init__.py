"""The tab "Laboratory": bench readings, photographs, designs of one's own, audits of published studies."""
