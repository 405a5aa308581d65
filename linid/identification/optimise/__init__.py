"""Global search, local least squares, and the stages in which a fit takes them."""
