"""What drives would show before anybody drives them: which effects stand out, which can be told apart, and which drive
would add most."""
