"""The blind check: units whose effect is drawn and withheld, diagnosed from their folders alone, then scored."""
