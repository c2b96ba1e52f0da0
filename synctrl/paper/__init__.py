"""Sun and Mills (2002): what its figures claim, its comparisons, and the page that shows them."""
