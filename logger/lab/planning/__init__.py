"""What drives would show before anybody drives them: which effects stand out, which can be distinguished, and which
drive would add most."""
