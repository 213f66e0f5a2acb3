"""What every kind of shape must say of itself, one file a kind: see ``registry``."""
