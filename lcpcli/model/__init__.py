"""What a problem is: M and q with what is known of them, the change of variables, and where it comes from."""
