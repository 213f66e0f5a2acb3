"""Rest with contact: where bodies come to rest, what carries them there, and closed contacts as joints."""
