"""Routes that original dashboards alone use; the others are beside this folder."""
