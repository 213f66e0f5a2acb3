"""Random mechanisms and contact scenes, and judges that do not rely on the program's own judgement."""
