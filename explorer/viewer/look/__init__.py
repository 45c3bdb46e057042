"""The tab of the view: colours, force chains, cuts, cameras, and one body under inspection."""
