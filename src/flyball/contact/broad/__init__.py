"""Which shapes may touch: cells, envelopes, the list of pairs, and who is who from step to step."""
